static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    int first = s[ACTED] == 0.0, n = (int)p[N], electric = (int)p[ELECTRIC_AT], i, j;
    int at = ESTIMATE + electric, free = n - electric == 4;
    double error = rsea_sense(p, s, y), wheel = s[LAST_MOTOR] / p[GEAR], load = s[LAST_LOAD];
    double origin = free ? 0.0 : load, off_wheel, off_load, forward, base, torque, integral, asked;
    double given, acting, next[LARGEST];
    const double *k = p + AT_K;
    rsea_prepared ahead;
    if (first) {
        s[at] = wheel - origin;
        if (free) s[at + 2] = load;
    }
    off_wheel = wheel - origin - s[at];
    off_load = free ? load - s[at + 2] : 0.0;
    for (i = 0; i < n; ++i)
        s[ESTIMATE + i] += p[AT_L + 2 * i] * off_wheel + p[AT_L + 2 * i + 1] * off_load;
    ahead = rsea_prepare(p, s, y);
    torque = ahead.torque + ahead.friction;
    forward = p[PER_TORQUE] * torque + p[PER_SPEED] * ahead.compensated;
    base = forward;
    if (electric) base -= k[0] * (s[ESTIMATE] - torque * p[PER_AMPERE]);
    if (free) {
        base -= k[electric] * (s[at] - s[at + 2] - ahead.wanted_d);
        base -= k[electric + 1] * (s[at + 1] - ahead.wanted_w - s[at + 3]);
        base -= (k[electric] + k[electric + 2]) * s[at + 2];
        base -= (k[electric + 1] + k[electric + 3]) * s[at + 3];
    } else {
        base -= k[electric] * (s[at] - ahead.wanted_d);
        base -= k[electric + 1] * (s[at + 1] - ahead.wanted_w);
    }
    base -= k[LARGEST] * (s[GIVEN] - forward);
    integral = s[SUM] + p[T] * error;
    asked = base - k[LARGEST + 1] * integral;
    if (fabs(asked) > p[LIMIT] && asked * error > 0.0) {
        integral = s[SUM];
        asked = base - k[LARGEST + 1] * integral;
    }
    s[SUM] = integral;
    given = rsea_clip(asked, p[LIMIT]);
    acting = p[LATE] != 0.0 ? s[GIVEN] : given;
    s[GIVEN] = p[LATE] != 0.0 ? given : 0.0;
    for (i = 0; i < n; ++i) {
        next[i] = p[AT_B + i] * acting;
        for (j = 0; j < n; ++j) next[i] += p[MATRICES + i * LARGEST + j] * s[ESTIMATE + j];
    }
    for (i = 0; i < n; ++i) s[ESTIMATE + i] = next[i];
    return given;
}
