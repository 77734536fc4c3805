/* The spring's law: rows of upper end, anchor, c0..c3, one for each region. */
static inline int rsea_region(const double *r, int n, double d) {
    int low = 0, high = n - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (r[6 * middle] <= d) low = middle + 1;
        else high = middle;
    }
    return low;
}
static inline double rsea_spring_torque(const double *r, int n, double d) {
    const double *c = r + 6 * rsea_region(r, n, d);
    double s = d - c[1];
    return c[2] + s * (c[3] + s * (c[4] + s * c[5]));
}
static inline double rsea_spring_tangent(const double *r, int n, double d) {
    const double *c = r + 6 * rsea_region(r, n, d);
    double s = d - c[1];
    return c[3] + s * (2.0 * c[4] + s * 3.0 * c[5]);
}
static inline double rsea_spring_deflection(const double *r, int n, double torque) {
    int j = 0, k;
    const double *c;
    double low, high, s;
    while (j < n - 1 && r[6 * (j + 1) + 2] <= torque) ++j;
    c = r + 6 * j;
    if (j == 0 || j == n - 1) return c[1] + (torque - c[2]) / c[3];
    low = 0.0;
    high = c[0] - c[1];
    s = (torque - c[2]) / (c[8] - c[2]) * high;
    for (k = 0; k < 60; ++k) {
        double error = c[2] + s * (c[3] + s * (c[4] + s * c[5])) - torque, step;
        if (error > 0.0) high = s;
        else low = s;
        step = s - error / (c[3] + s * (2.0 * c[4] + s * 3.0 * c[5]));
        if (!(low < step && step < high)) step = 0.5 * (low + high);
        if (fabs(step - s) <= 1e-15 * (fabs(c[1]) + fabs(s))) return c[1] + step;
        s = step;
    }
    return c[1] + s;
}
static inline double rsea_clip(double x, double limit) {
    return x > limit ? limit : x < -limit ? -limit : x;
}
