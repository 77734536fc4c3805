static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    int first = s[ACTED] == 0.0;
    double error = rsea_sense(p, s, y), wheel = s[LAST_MOTOR] / p[GEAR], load = s[LAST_LOAD];
    double t = p[T], pole = p[Q], torque, push, angle, speed, miss, u, asked, given;
    rsea_prepared ahead;
    if (first) s[ANGLE] = wheel;
    torque = s[ACTING] / p[PER_TORQUE];
    torque -= (p[DAMPING] + p[ELECTRIC_DAMPING]) * s[SPEED];
    torque += s[EXTRA] - rsea_spring_torque(p + SPRING, REGIONS, s[ANGLE] - load);
    push = torque / p[INERTIA];
    angle = s[ANGLE] + t * s[SPEED] + 0.5 * t * t * push;
    speed = s[SPEED] + t * push;
    miss = wheel - angle;
    s[ANGLE] = angle + (1.0 - pole * pole * pole) * miss;
    s[SPEED] = speed + 1.5 * (1.0 - pole) * (1.0 - pole) * (1.0 + pole) / t * miss;
    s[EXTRA] = rsea_clip(
        s[EXTRA] + p[INERTIA] * (1.0 - pole) * (1.0 - pole) * (1.0 - pole) / (t * t) * miss,
        p[Z_LIMIT]);
    ahead = rsea_prepare(p, s, y);
    u = ahead.torque + ahead.friction - p[SHARE] * (s[EXTRA] + ahead.friction);
    u += p[KP] * error + p[KD] * s[SLOPE_E];
    asked = rsea_integrated(
        p, s, p[PER_TORQUE] * u + p[PER_SPEED] * ahead.compensated, p[KI] * t * error);
    given = rsea_clip(asked, p[LIMIT]);
    s[ACTING] = p[LATE] != 0.0 ? s[GIVEN] : given;
    s[GIVEN] = given;
    return given;
}
