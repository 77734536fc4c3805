/* What stands between a sensor, the law and the drive.
 *
 * A reading that is not finite, jumps, is old (its count has not changed) or comes late is a fault:
 * the last command is held, and after most_held of them in a row the controller trips. It trips at
 * once where the spring's torque or the load's angle leaves its limits, where the mean square of the
 * current (estimated from command and speed, first order with thermal_s) exceeds that of
 * continuous_A, or where no call came for watchdog_s. Tripped or not enabled, the command is zero; only enable = 0 makes it start anew.
 * Enabled, the reference moves from what is measured then to what is asked within blend_s.
 * A timer of its own, which runs if the control task hangs, asks rsea_overdue.
 */
typedef enum {
    rsea_good, rsea_not_finite, rsea_jump, rsea_old, rsea_late, rsea_over_torque, rsea_over_travel,
    rsea_over_heat
} rsea_fault;
typedef struct {
    double dt_share;                           /* of the period, by which dt may be off */
    double watchdog_s;
    double motor_speed, load_speed;            /* rad/s; beyond them an angle has jumped */
    double rate;                               /* of the command, per second */
    double torque_Nm, lowest_rad, highest_rad; /* of the spring; of the load */
    double blend_s;
    double continuous_A, thermal_s;            /* the current the drive stands for ever */
    int most_held;
} rsea_limits;
typedef struct {
    rsea_state law;
    rsea_fault fault, tripped; /* of this sample; why the command is zero */
    double given, motor, load, from, enabled_s, since_s;
    double heat; /* A^2; kept while not enabled */
    unsigned count;
    int held, running;
} rsea_guard;
static inline void rsea_guard_start(rsea_guard *g) {
    g->heat = 0.0;
    rsea_start(&g->law);
    g->fault = g->tripped = rsea_good;
    g->given = g->motor = g->load = g->from = g->enabled_s = g->since_s = 0.0;
    g->count = 0u;
    g->held = g->running = 0;
}
static inline int rsea_overdue(const rsea_limits *l, double since_last_call_s) {
    return !(since_last_call_s <= l->watchdog_s);
}
static inline double rsea_spring_torque_read(const rsea_input *y) {
    return rsea_spring_torque(rsea_parameters + SPRING, REGIONS,
        y->motor_angle_rad / rsea_parameters[GEAR] - y->load_angle_rad);
}
/* Mean square of the current over the time since the last call, by the command of that time. */
static inline double rsea_heated(
    const rsea_guard *g, const rsea_limits *l, const rsea_input *y, double dt_s) {
    double dt = isfinite(dt_s) && dt_s > 0.0 ? dt_s : PERIOD_s;
    double amps = AMPS_PER_COMMAND * g->given;
    double speed = (y->motor_angle_rad - g->motor) / (g->since_s + dt);
    if (g->running && fabs(speed) <= l->motor_speed) amps -= AMPS_PER_SPEED * speed;
    amps = fmin(fmax(amps, -(MOST_A)), MOST_A);
    return g->heat + (amps * amps - g->heat) * dt / (l->thermal_s + dt);
}
static inline rsea_fault rsea_fault_of(
    const rsea_guard *g, const rsea_limits *l, const rsea_input *y, double dt_s, unsigned count) {
    if (!isfinite(y->reference) || !isfinite(y->reference_rate) || !isfinite(dt_s)
        || !isfinite(y->reference_acceleration) || !isfinite(y->motor_angle_rad)
        || !isfinite(y->load_angle_rad)) return rsea_not_finite;
    if (!g->running) return rsea_good;
    if (count == g->count) return rsea_old;
    if (fabs(y->motor_angle_rad - g->motor) > l->motor_speed * g->since_s
        || fabs(y->load_angle_rad - g->load) > l->load_speed * g->since_s) return rsea_jump;
    if (fabs(dt_s - PERIOD_s) > l->dt_share * PERIOD_s) return rsea_late;
    return rsea_good;
}
static inline double rsea_trip(rsea_guard *g, rsea_fault why) {
    g->tripped = g->fault = why;
    g->given = 0.0;
    return 0.0;
}
/* The command. dt_s: measured since the last call; count: of the readings, another one for each. */
static inline double rsea_guarded(rsea_guard *g, const rsea_limits *l, const rsea_input *input,
    double dt_s, unsigned count, int enable) {
    rsea_input y = *input;
    double wanted, most, heat = rsea_heated(g, l, &y, dt_s);
    if (!enable) {
        rsea_guard_start(g);
        g->heat = heat;
        return 0.0;
    }
    g->heat = heat;
    if (g->tripped != rsea_good) return 0.0;
    if (g->running && rsea_overdue(l, dt_s)) return rsea_trip(g, rsea_late);
    g->since_s += isfinite(dt_s) ? dt_s : PERIOD_s;
    g->fault = rsea_fault_of(g, l, &y, dt_s, count);
    if (g->fault != rsea_good) {
        if (g->fault == rsea_late) { /* the reading itself is good: the next one is near it */
            g->motor = y.motor_angle_rad;
            g->load = y.load_angle_rad;
            g->count = count;
            g->since_s = 0.0;
        }
        g->held += 1;
        return g->held > l->most_held ? rsea_trip(g, g->fault) : g->given;
    }
    if (fabs(rsea_spring_torque_read(&y)) > l->torque_Nm) return rsea_trip(g, rsea_over_torque);
    if (y.load_angle_rad < l->lowest_rad || y.load_angle_rad > l->highest_rad)
        return rsea_trip(g, rsea_over_travel);
    if (heat > l->continuous_A * l->continuous_A) return rsea_trip(g, rsea_over_heat);
    g->motor = y.motor_angle_rad;
    g->load = y.load_angle_rad;
    g->count = count;
    g->since_s = 0.0;
    g->held = 0;
    if (!g->running) {
        g->running = 1;
        g->from = MEASURED;
    } else {
        g->enabled_s += dt_s;
    }
    if (g->enabled_s < l->blend_s) {
        double share = g->enabled_s / l->blend_s, far = y.reference - g->from;
        y.reference = g->from + share * far;
        y.reference_acceleration =
            share * y.reference_acceleration + 2.0 * y.reference_rate / l->blend_s;
        y.reference_rate = share * y.reference_rate + far / l->blend_s;
    }
    wanted = rsea_step(&g->law, &y);
    if (!isfinite(wanted)) return rsea_trip(g, rsea_not_finite);
    most = l->rate * PERIOD_s;
    if (wanted > g->given + most) wanted = g->given + most;
    if (wanted < g->given - most) wanted = g->given - most;
    g->given = wanted;
    return wanted;
}
