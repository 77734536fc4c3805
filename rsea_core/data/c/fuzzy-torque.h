static inline double rsea_member(const double *set, double x) {
    double found;
    if (x <= set[1]) {
        if (set[0] == set[1]) return 1.0;
        found = (x - set[0]) / (set[1] - set[0]);
    } else {
        if (set[1] == set[2]) return 1.0;
        found = (set[2] - x) / (set[2] - set[1]);
    }
    return found > 0.0 ? found : 0.0;
}
/* min-AND, summed clipped sets, centre of gravity by areas and moments of trapezoids */
static inline double rsea_infer(const double *f, double x, double y) {
    int n = (int)f[0], m = (int)f[1], q = (int)f[2], i, j;
    const double *first = f + 5, *second = first + 3 * n, *output = second + 3 * m;
    const double *rules = output + 3 * q;
    double area = 0.0, moment = 0.0;
    for (i = 0; i < n; ++i) {
        double one = rsea_member(first + 3 * i, x);
        if (one == 0.0) continue;
        for (j = 0; j < m; ++j) {
            double h = rsea_member(second + 3 * j, y), up, flat, down, l, c, r;
            const double *set;
            if (one < h) h = one;
            if (h == 0.0) continue;
            set = output + 3 * (int)rules[i * m + j];
            up = h * (set[1] - set[0]);
            flat = (1.0 - h) * (set[2] - set[0]);
            down = h * (set[2] - set[1]);
            l = 0.5 * h * up;
            c = h * flat;
            r = 0.5 * h * down;
            area += l + c + r;
            moment += l * (set[0] + up * (2.0 / 3.0));
            moment += c * (set[0] + up + 0.5 * flat) + r * (set[2] - down * (2.0 / 3.0));
        }
    }
    return area > 0.0 ? moment / area : f[4];
}
static inline double rsea_law(const double *p, double *s, const rsea_input *y) {
    double error = rsea_sense(p, s, y), percent, base;
    rsea_prepared ahead = rsea_prepare(p, s, y);
    percent = rsea_infer(p + TABLE, -p[PER_ERROR] * error, -p[PER_RATE] * s[SLOPE_E]);
    base = p[PER_PERCENT] * (percent - 50.0);
    base += p[PER_TORQUE] * (ahead.torque + ahead.friction) + p[PER_SPEED] * ahead.compensated;
    return rsea_clip(rsea_integrated(p, s, base, p[KI] * p[T] * error), p[LIMIT]);
}
