static inline double rsea_power(const double *p, double x, double exponent) {
    if (x == 0.0) return exponent == 0.0 && p[ZERO_POWER] != 0.0 ? 1.0 : 0.0;
    return x > 0.0 ? pow(x, exponent) : -pow(-x, exponent);
}
static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    double x = y->load_angle_rad * p[UNIT], r = y->reference * p[UNIT];
    double rate = y->reference_rate * p[UNIT], acceleration = y->reference_acceleration * p[UNIT];
    double speed, torque, force, slow, far, pushed, u;
    if (p[BENCH] != 0.0) {
        speed = ((x - s[LAST_X]) / p[T] + s[V1] + s[V2]) / 3.0;
        rate = (r - s[LAST_R]) / p[T];
        acceleration = (rate - s[LAST_RATE]) / p[T];
        s[LAST_R] = r;
        s[LAST_RATE] = rate;
    } else {
        if (s[ACTED] == 0.0) {
            s[ACTED] = 1.0;
            s[LAST_X] = x;
        }
        speed = p[KEEP] * s[V1] + (1.0 - p[KEEP]) * (x - s[LAST_X]) / p[T];
    }
    s[V2] = s[V1];
    s[V1] = speed;
    s[LAST_X] = x;
    torque = rsea_spring_torque(p + SPRING, REGIONS, y->motor_angle_rad / p[GEAR] - y->load_angle_rad);
    force = s[TIME] >= p[FORCE_FROM] - 0.5 * p[T] ? p[FORCE] : 0.0;
    s[TIME] += p[T];
    if (p[WEIGHTING] == 0.0) {
        slow = p[S] * (rate - speed);
        far = p[S] * (r - x);
    } else {
        slow = p[S] * rate - speed;
        far = p[S] * r - x;
    }
    pushed = p[KV] * p[DAMPING] * rsea_power(p, slow, p[BETA]);
    pushed += p[KP] * p[STIFFNESS] * rsea_power(p, far, p[GAMMA]);
    pushed += p[FORCE_SIGN] * rsea_power(p, 1.0 - p[S], p[DELTA]) * force;
    pushed -= p[PER_TORQUE] * torque;
    u = rsea_power(p, p[S] * acceleration, p[ALPHA]) + p[PER_INERTIA] * pushed;
    return rsea_clip(p[PER_UNIT] * u, p[LIMIT]);
}
