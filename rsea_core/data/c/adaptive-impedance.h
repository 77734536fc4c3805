static inline double rsea_power(double x, double exponent) {
    if (x == 0.0) return 0.0;
    return x > 0.0 ? pow(x, exponent) : -pow(-x, exponent);
}
static inline double rsea_within(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}
/* weighted mean of the rules' levels, 0 to 1: 0 to 50 Nm/rad, -100 to 100 Nm/(rad s) */
static inline double rsea_level(const double *rules, double stiffness, double rate) {
    double x = rsea_within(stiffness / 50.0, 0.0, 1.0);
    double y = rsea_within(0.5 + 0.5 * rate / 100.0, 0.0, 1.0), weight = 0.0, total = 0.0;
    int i, j;
    for (i = 0; i < 5; ++i) {
        double far = (y - 0.25 * (double)i) / 0.125;
        double one = exp(-0.6931471805599453 * far * far);
        for (j = 0; j < 5; ++j) {
            double off = (x - 0.25 * (double)j) / 0.125;
            double both = one * exp(-0.6931471805599453 * off * off);
            weight += both;
            total += both * rules[5 * i + j] * 0.25;
        }
    }
    return total / weight;
}
/* recursive least squares of the environment's stiffness, and its filtered rate */
static inline void rsea_estimate(const double *p, double *s, double torque, double angle) {
    double moved = angle - s[LAST_ANGLE], gained = torque - s[LAST_TORQUE], gain, last;
    if (fabs(torque) < p[PRESSING]) {
        s[LAST_ANGLE] = angle;
        s[LAST_TORQUE] = torque;
        s[K_RATE] = p[RATE_KEEP] * s[K_RATE];
        return;
    }
    if (fabs(moved) < 1e-3) return;
    gain = s[P] * moved / (p[FORGET] + s[P] * moved * moved);
    last = s[K_E];
    s[K_E] = rsea_within(last + gain * (gained - last * moved), 0.0, 100.0);
    s[P] = (s[P] - gain * moved * s[P]) / p[FORGET];
    if (s[P] > 1e6) s[P] = 1e6;
    s[K_RATE] = p[RATE_KEEP] * s[K_RATE] + (1.0 - p[RATE_KEEP]) * (s[K_E] - last) / p[T];
    s[LAST_ANGLE] = angle;
    s[LAST_TORQUE] = torque;
}
/* one of the exponents, between those for a soft and for a hard environment */
static inline double rsea_exponent(const double *p, int which, double level) {
    return p[ENDS + which] + level * (p[ENDS + which + 5] - p[ENDS + which]);
}
static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    double angle = y->load_angle_rad, x = angle * p[UNIT], torque, force, level, wanted;
    double far, slow, by_angle, weak, rough, by_force;
    torque = rsea_spring_torque(p + SPRING, REGIONS, y->motor_angle_rad / p[GEAR] - angle);
    force = p[PER_TORQUE] * torque;
    if (s[ACTED] == 0.0) {
        s[ACTED] = 1.0;
        s[LAST_X] = x;
        s[LAST_F] = force;
        s[P] = 1e4;
        s[LAST_ANGLE] = angle;
        s[LAST_TORQUE] = torque;
    }
    s[SPEED] = p[KEEP] * s[SPEED] + (1.0 - p[KEEP]) * (x - s[LAST_X]) / p[T];
    s[F_SPEED] = p[KEEP] * s[F_SPEED] + (1.0 - p[KEEP]) * (force - s[LAST_F]) / p[T];
    s[LAST_X] = x;
    s[LAST_F] = force;
    rsea_estimate(p, s, torque, angle);
    level = rsea_level(p + RULE_AT, s[K_E], s[K_RATE]);
    wanted = s[TIME] >= p[FORCE_FROM] - 0.5 * p[T] ? p[FORCE] : 0.0;
    s[TIME] += p[T];
    far = p[KPP] * p[STIFFNESS] * rsea_power(y->reference * p[UNIT] - x, rsea_exponent(p, 2, level));
    slow = p[KVP] * p[DAMPING]
        * rsea_power(y->reference_rate * p[UNIT] - s[SPEED], rsea_exponent(p, 1, level));
    by_angle = rsea_power(y->reference_acceleration * p[UNIT], rsea_exponent(p, 0, level))
        + p[PER_INERTIA] * (far + slow);
    weak = p[KPF] * p[STIFFNESS] * rsea_power(wanted - force, rsea_exponent(p, 4, level));
    rough = p[KVF] * p[DAMPING] * rsea_power(-s[F_SPEED], rsea_exponent(p, 3, level));
    by_force = p[PER_INERTIA] * (weak + rough);
    return rsea_clip(p[PER_UNIT] * (p[S] * by_angle + (1.0 - p[S]) * by_force), p[LIMIT]);
}
