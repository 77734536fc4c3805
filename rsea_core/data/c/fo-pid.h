/* a sample through a chain of first-order sections: gain, then zero and pole of each in z */
static inline double rsea_through(const double *chain, double *s, double x) {
    int i;
    for (i = 0; i < SECTIONS; ++i) {
        double y = chain[2 + 2 * i] * s[2 * i + 1] + x - chain[1 + 2 * i] * s[2 * i];
        s[2 * i] = x;
        s[2 * i + 1] = y;
        x = y;
    }
    return chain[0] * x;
}
static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    double error = rsea_sense(p, s, y), slow, fast, torque, base;
    rsea_prepared ahead = rsea_prepare(p, s, y);
    slow = rsea_through(p + I_CHAIN, s + I_STATE, error);
    fast = rsea_through(p + D_CHAIN, s + D_STATE, error);
    torque = ahead.torque + (ahead.friction + p[KP] * error + p[KD] * fast);
    base = p[PER_TORQUE] * torque + p[PER_SPEED] * ahead.compensated;
    return rsea_clip(rsea_integrated(p, s, base, p[KI] * p[T] * slow), p[LIMIT]);
}
