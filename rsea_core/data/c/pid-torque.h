static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    double error = rsea_sense(p, s, y), torque, base;
    rsea_prepared ahead = rsea_prepare(p, s, y);
    torque = ahead.torque + (ahead.friction + p[KP] * error + p[KD] * s[SLOPE_E]);
    base = p[PER_TORQUE] * torque + p[PER_SPEED] * ahead.compensated;
    return rsea_clip(rsea_integrated(p, s, base, p[KI] * p[T] * error), p[LIMIT]);
}
