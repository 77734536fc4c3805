/* Signals, feedforward, friction compensation and command, as every torque loop has them. */
static inline double rsea_sense(const double *p, double *s, const rsea_input *y) {
    double keep_e = p[D_KEEP], keep_l = p[LOAD_KEEP], speed;
    double error = y->reference
        - rsea_spring_torque(p + SPRING, REGIONS, y->motor_angle_rad / p[GEAR] - y->load_angle_rad);
    if (s[ACTED] == 0.0) {
        s[ACTED] = 1.0;
        s[LAST_E] = error;
        s[LAST_LOAD] = y->load_angle_rad;
        s[LAST_MOTOR] = y->motor_angle_rad;
    }
    s[SLOPE_E] = keep_e * s[SLOPE_E] + (1.0 - keep_e) * (error - s[LAST_E]) / p[T];
    speed = keep_l * s[LOAD_W] + (1.0 - keep_l) * (y->load_angle_rad - s[LAST_LOAD]) / p[T];
    s[LOAD_A] = keep_l * s[LOAD_A] + (1.0 - keep_l) * (speed - s[LOAD_W]) / p[T];
    s[LOAD_W] = speed;
    s[MOTOR_W] = keep_e * s[MOTOR_W]
        + (1.0 - keep_e) * (y->motor_angle_rad - s[LAST_MOTOR]) / p[T];
    s[LAST_E] = error;
    s[LAST_LOAD] = y->load_angle_rad;
    s[LAST_MOTOR] = y->motor_angle_rad;
    return error;
}
static inline double rsea_friction(const double *p, double speed, double torque) {
    double level = speed > 0.0 ? p[FORWARD] : p[BACKWARD];
    double loss = speed * torque > 0.0 ? p[DRIVE_LOSS] : p[BACKDRIVE_LOSS], friction;
    if (p[RISE] > 0.0) {
        double ratio = speed / p[STRIBECK];
        level *= 1.0 + p[RISE] * exp(-(ratio * ratio));
    }
    friction = (level + loss * fabs(torque)) * tanh(speed / p[SMOOTHING]);
    if (p[ATAN_LEVEL] != 0.0) friction += p[ATAN_LEVEL] * atan(speed / p[ATAN_VELOCITY]);
    return friction + p[VISCOUS] * speed + p[OFFSET];
}
typedef struct {
    double torque, friction, compensated, wanted_w, wanted_d;
} rsea_prepared;
static inline rsea_prepared rsea_prepare(const double *p, const double *s, const rsea_input *y) {
    rsea_prepared found = {0.0, 0.0, 0.0, 0.0, 0.0};
    double stiffness, w, a;
    found.wanted_d = rsea_spring_deflection(p + SPRING, REGIONS, y->reference);
    stiffness = rsea_spring_tangent(p + SPRING, REGIONS, found.wanted_d);
    found.wanted_w = y->reference_rate / stiffness;
    w = found.wanted_w;
    a = y->reference_acceleration / stiffness;
    if (p[FOLLOW_LOAD] >= 1.0) w += s[LOAD_W];
    if (p[FOLLOW_LOAD] == 2.0) a += s[LOAD_A];
    if (p[FEEDFORWARD] != 0.0) found.torque = y->reference + p[INERTIA] * a + p[DAMPING] * w;
    if (p[COMPENSATION] != 0.0) found.friction = p[COMPENSATION] * rsea_friction(p, w, y->reference);
    if (p[EMF] == 1.0) found.compensated = w;
    else if (p[EMF] == 2.0) found.compensated = s[MOTOR_W] / p[GEAR];
    return found;
}
static inline double rsea_integrated(const double *p, double *s, double base, double rate) {
    double integral = s[INTEGRAL] + rate, asked = base + p[PER_TORQUE] * integral;
    if (fabs(asked) > p[LIMIT] && asked * rate > 0.0) {
        integral = s[INTEGRAL];
        asked = base + p[PER_TORQUE] * integral;
    }
    s[INTEGRAL] = integral;
    return asked;
}
