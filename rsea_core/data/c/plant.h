/* The machine: winding, wheel, spring, load, with stick and slip, current limit and contact.

   Fourth order of Runge and Kutta in steps of PLANT_STEP_s or shorter, a share of the fastest mode;
   each switch is located by bisection of its step. States: current [A], wheel angle [rad], wheel
   speed, load angle, load speed, all on the output side of the gear. Zero the struct, set the
   angles, call rsea_plant_start. */
typedef struct {
    double x[5];
    double command, load_torque_Nm;
    int wheel, load, limited, contact; /* way of sliding (0 sticks), side of the limit, in contact */
} rsea_plant;

static double rsea_plant_current(const rsea_plant *p, const double *x) {
    if (DRIVE == CURRENT) return rsea_clip(p->command, CURRENT_LIMIT);
    if (DRIVE == MOTOR_TORQUE) return 0.0;
    if (INDUCTANCE > 0.0) return p->limited ? p->limited * CURRENT_LIMIT : x[0];
    return rsea_clip((VOLTS_PER_COMMAND * p->command - VOLTS_PER_SPEED * x[2]) / RESISTANCE,
                     CURRENT_LIMIT);
}
static double rsea_plant_torque(const double *x) {
    return rsea_spring_torque(REGIONS, N_REGIONS, x[1] - x[3]);
}
/* Torques without dry friction, on the wheel and on the load. */
static void rsea_plant_pushes(const rsea_plant *p, const double *x, double *wheel, double *load) {
    const double spring = rsea_plant_torque(x);
    *wheel = TORQUE_PER_AMPERE * rsea_plant_current(p, x) - DAMPING * x[2] - spring;
    if (DRIVE == MOTOR_TORQUE) *wheel += TORQUE_PER_MOTOR_TORQUE * p->command;
    *load = spring + LOAD_TORQUE + p->load_torque_Nm - LOAD_DAMPING * x[4];
    if (GRAVITY != 0.0) *load -= GRAVITY * sin(x[3] + GRAVITY_OFFSET);
    if (p->contact) *load -= CONTACT_STIFFNESS * (x[3] - CONTACT_ANGLE) + CONTACT_DAMPING * x[4];
}
static double rsea_plant_current_rate(const rsea_plant *p, const double *x) {
    const double volts = VOLTS_PER_COMMAND * p->command;
    return INDUCTANCE > 0.0
        ? (volts - RESISTANCE * rsea_plant_current(p, x) - VOLTS_PER_SPEED * x[2]) / INDUCTANCE
        : 0.0;
}
static double rsea_plant_level(double way) { return way > 0.0 ? DRY_FORWARD : DRY_BACKWARD; }

static void rsea_plant_rates(const rsea_plant *p, const double *x, double *rate) {
    const int wheel_sticks = WHEEL_DRY && p->wheel == 0, load_sticks = LOAD_DRY && p->load == 0;
    double wheel, load;
    rsea_plant_pushes(p, x, &wheel, &load);
    if (WHEEL_DRY) wheel -= p->wheel * rsea_plant_level(p->wheel);
    if (LOAD_DRY) load -= p->load * LOAD_DRY_LEVEL;
    rate[0] = p->limited ? 0.0 : rsea_plant_current_rate(p, x);
    rate[1] = wheel_sticks ? 0.0 : x[2];
    rate[2] = wheel_sticks ? 0.0 : wheel / INERTIA;
    rate[3] = load_sticks || LOAD_HELD ? 0.0 : x[4];
    rate[4] = load_sticks || LOAD_HELD ? 0.0 : load / LOAD_INERTIA;
}
static void rsea_plant_step(const rsea_plant *p, double h, double *x) {
    static const double share[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double rate[5] = {0}, at[5], sum[5] = {0};
    int stage, j;
    for (stage = 0; stage < 4; ++stage) {
        for (j = 0; j < 5; ++j) at[j] = p->x[j] + share[stage] * h * rate[j];
        rsea_plant_rates(p, at, rate);
        for (j = 0; j < 5; ++j) sum[j] += weight[stage] * rate[j];
    }
    for (j = 0; j < 5; ++j) x[j] = p->x[j] + h / 6.0 * sum[j];
}
/* Which switch must act at a state: 1 wheel, 2 load, 3 current limit, 4 contact; 0 none. */
static int rsea_plant_switch(const rsea_plant *p, const double *x) {
    double wheel, load;
    rsea_plant_pushes(p, x, &wheel, &load);
    if (WHEEL_DRY && (p->wheel ? p->wheel * x[2] < 0.0 : fabs(wheel) > rsea_plant_level(wheel)))
        return 1;
    if (LOAD_DRY && !LOAD_HELD && (p->load ? p->load * x[4] < 0.0 : fabs(load) > LOAD_DRY_LEVEL))
        return 2;
    if (INDUCTANCE > 0.0 && (DRIVE == DUTY || DRIVE == VOLTAGE)
        && (p->limited ? p->limited * rsea_plant_current_rate(p, x) < 0.0
                       : fabs(x[0]) > CURRENT_LIMIT
                             || (fabs(x[0]) == CURRENT_LIMIT
                                 && x[0] * rsea_plant_current_rate(p, x) > 0.0)))
        return 3;
    return p->contact != (x[3] > CONTACT_ANGLE) && !LOAD_HELD ? 4 : 0;
}
static void rsea_plant_act(rsea_plant *p, int which) {
    double wheel, load;
    if (which == 3) {
        p->limited = p->limited ? 0 : p->x[0] > 0.0 ? 1 : -1;
        if (p->limited) p->x[0] = p->limited * CURRENT_LIMIT;
    }
    if (which == 4) p->contact = !p->contact;
    if (which == 1) p->x[2] = 0.0;
    if (which == 2) p->x[4] = 0.0;
    rsea_plant_pushes(p, p->x, &wheel, &load);
    if (which == 1) p->wheel = fabs(wheel) > rsea_plant_level(wheel) ? (wheel > 0.0 ? 1 : -1) : 0;
    if (which == 2) p->load = fabs(load) > LOAD_DRY_LEVEL ? (load > 0.0 ? 1 : -1) : 0;
}
/* The modes at rest, for the angles and the command that are set. */
static void rsea_plant_start(rsea_plant *p) {
    p->contact = p->x[3] > CONTACT_ANGLE && !LOAD_HELD;
    p->wheel = p->load = p->limited = 0;
}
/* Move on by a time; 0 done, 1 too many switches or not finite. */
static int rsea_plant_advance(rsea_plant *p, double time_s) {
    double left = time_s, x[5];
    int switches = 0, which, j;
    for (j = 0; j < 4 && (which = rsea_plant_switch(p, p->x)) != 0; ++j) rsea_plant_act(p, which);
    while (left > 1e-15 * time_s) {
        const double pieces = ceil(left / PLANT_STEP_s);
        double h = left / (pieces > 1.0 ? pieces : 1.0);
        rsea_plant_step(p, h, x);
        which = rsea_plant_switch(p, x);
        if (which) {
            double low = 0.0, high = h;
            for (j = 0; j < 60 && high - low > 1e-15 * time_s; ++j) {
                const double middle = 0.5 * (low + high);
                const int found = (rsea_plant_step(p, middle, x), rsea_plant_switch(p, x));
                if (found) high = middle, which = found;
                else low = middle;
            }
            rsea_plant_step(p, high, x);
            h = high;
        }
        for (j = 0; j < 5; ++j) p->x[j] = x[j];
        left -= h;
        if (which) rsea_plant_act(p, which);
        if (!isfinite(p->x[2] + p->x[4]) || (switches += which != 0) > 1000) return 1;
    }
    return 0;
}
