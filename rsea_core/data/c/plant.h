/* The machine: winding, wheel, spring, load, with stick and slip, current limit and contact.

   Fourth order of Runge and Kutta in steps of PLANT_STEP_s or shorter, a share of the fastest mode;
   each switch is located by bisection of its step. States: current [A], wheel angle [rad], wheel
   speed, load angle, load speed, all on the output side of the gear; of some effects also the rises
   of winding and case [K], the stretches of three branches of the spring [rad], angle and speed of
   the link's outer part. Zero the struct, set the angles, call rsea_plant_start. */
enum { CURRENT_x, WHEEL_x, WHEEL_RATE_x, LOAD_x, LOAD_RATE_x, WINDING_x, CASE_x, BRANCH_x,
       LINK_x = BRANCH_x + N_BRANCHES, LINK_RATE_x, MOST_STATES };
typedef struct {
    double x[MOST_STATES];
    double command, load_torque_Nm;
    int wheel, load, limited, contact; /* way of sliding (0 sticks), side of the limit, in contact */
    int torque_sign, returns, knee;    /* of the spring; the bridge returns current; its region */
} rsea_plant;

static double rsea_plant_factor(const double *x) {
    return rsea_constant_factor(x[WHEEL_x], x[WINDING_x], x[CASE_x]);
}
static double rsea_plant_resistance(const double *x) {
    return RESISTANCE * (1.0 + E_resistance_rise * x[WINDING_x]);
}
/* Voltage that drives a current: the command's less the back-EMF. */
static double rsea_plant_driving(const rsea_plant *p, const double *x) {
    return VOLTS_PER_COMMAND * rsea_acting(p->command)
        - rsea_plant_factor(x) * VOLTS_PER_SPEED * x[WHEEL_RATE_x];
}
static double rsea_plant_current(const rsea_plant *p, const double *x) {
    const double command = rsea_acting(p->command);
    if (DRIVE == CURRENT) return rsea_clip(command, CURRENT_LIMIT);
    if (DRIVE == MOTOR_TORQUE) return 0.0;
    if (INDUCTANCE > 0.0) return p->limited ? p->limited * CURRENT_LIMIT : x[CURRENT_x];
    return rsea_clip(
        rsea_static_current(rsea_plant_driving(p, x),
                            rsea_plant_resistance(x) + rsea_source(command, p->returns)),
        CURRENT_LIMIT);
}
static double rsea_plant_deflection(const double *x) {
    return x[WHEEL_x] - x[LOAD_x] + rsea_gear_error(x[WHEEL_x]);
}
static double rsea_plant_lever(const double *x) { return 1.0 + rsea_gear_error_slope(x[WHEEL_x]); }
static double rsea_plant_deflection_rate(const double *x) {
    return rsea_plant_lever(x) * x[WHEEL_RATE_x] - x[LOAD_RATE_x];
}
static double rsea_plant_torque(const double *x) {
    double torque = rsea_spring_torque(REGIONS, N_REGIONS, rsea_plant_deflection(x));
    int j;
    if (E_spring_damping != 0.0) torque += E_spring_damping * rsea_plant_deflection_rate(x);
    for (j = 0; j < N_BRANCHES && N_STATES > WINDING_x; ++j)
        torque += BRANCH_STIFFNESS[j] * x[BRANCH_x + j];
    return torque;
}
/* Torques without dry friction, on the wheel and on the load. */
static void rsea_plant_pushes(const rsea_plant *p, const double *x, double *wheel, double *load) {
    const double spring = rsea_plant_torque(x);
    *wheel = rsea_plant_factor(x) * TORQUE_PER_AMPERE * rsea_plant_current(p, x)
        - DAMPING * x[WHEEL_RATE_x] - rsea_plant_lever(x) * spring
        + rsea_wheel_torque(x[WHEEL_x], x[WHEEL_RATE_x]);
    if (DRIVE == MOTOR_TORQUE) *wheel += TORQUE_PER_MOTOR_TORQUE * rsea_acting(p->command);
    *load = spring + LOAD_TORQUE + p->load_torque_Nm - LOAD_DAMPING * x[LOAD_RATE_x]
        + rsea_load_torque(x[LOAD_x], x[LOAD_RATE_x]);
    if (GRAVITY != 0.0) *load -= GRAVITY * sin(x[LOAD_x] + GRAVITY_OFFSET);
    if (p->contact) *load -= rsea_contact(x[LOAD_x] - CONTACT_ANGLE, x[LOAD_RATE_x]);
    if (E_link_stiffness > 0.0)
        *load -= E_link_stiffness * (x[LOAD_x] - x[LINK_x])
            + E_link_damping * (x[LOAD_RATE_x] - x[LINK_RATE_x]);
}
static double rsea_plant_current_rate(const rsea_plant *p, const double *x) {
    const double current = rsea_plant_current(p, x);
    const double source = rsea_source(rsea_acting(p->command), p->returns);
    return INDUCTANCE > 0.0
        ? (rsea_plant_driving(p, x) - (rsea_plant_resistance(x) + source) * current
           - rsea_dead_time_volts(current)) / INDUCTANCE
        : 0.0;
}
static double rsea_plant_wheel_level(const rsea_plant *p, const double *x, double way) {
    return rsea_gear_level(way, x[WHEEL_RATE_x], rsea_plant_torque(x), p->torque_sign);
}
static double rsea_plant_load_level(const double *x) {
    return rsea_load_level(x[LOAD_x] + GRAVITY_OFFSET, x[LOAD_RATE_x]);
}
/* Rates of the states that only some effects have. */
static void rsea_plant_further_rates(const rsea_plant *p, const double *x, double *rate) {
    const double current = rsea_plant_current(p, x), stretch = rsea_plant_deflection_rate(x);
    const double twist_rate = x[LOAD_RATE_x] - x[LINK_RATE_x];
    int j;
    for (j = 0; j < N_BRANCHES; ++j)
        rate[BRANCH_x + j] =
            BRANCH_TIME[j] > 0.0 ? stretch - x[BRANCH_x + j] / BRANCH_TIME[j] : 0.0;
    if (E_winding_heat_capacity > 0.0) {
        const double passed = E_winding_to_case * (x[WINDING_x] - x[CASE_x]);
        const double joule = rsea_plant_resistance(x) * current * current;
        rate[WINDING_x] = (joule - passed) / E_winding_heat_capacity;
        rate[CASE_x] = (passed - E_case_to_ambient * x[CASE_x]) / E_case_heat_capacity;
    }
    if (E_link_stiffness > 0.0) {
        rate[LINK_x] = x[LINK_RATE_x];
        rate[LINK_RATE_x] = (E_link_stiffness * (x[LOAD_x] - x[LINK_x])
                             + E_link_damping * twist_rate) / E_link_inertia;
    }
}
static void rsea_plant_rates(const rsea_plant *p, const double *x, double *rate) {
    const int wheel_sticks = WHEEL_DRY && p->wheel == 0, load_sticks = LOAD_DRY && p->load == 0;
    double wheel, load;
    rsea_plant_pushes(p, x, &wheel, &load);
    if (WHEEL_DRY && !wheel_sticks) wheel -= p->wheel * rsea_plant_wheel_level(p, x, p->wheel);
    if (LOAD_DRY && !load_sticks) load -= p->load * rsea_plant_load_level(x);
    rate[CURRENT_x] = p->limited ? 0.0 : rsea_plant_current_rate(p, x);
    rate[WHEEL_x] = wheel_sticks ? 0.0 : x[WHEEL_RATE_x];
    rate[WHEEL_RATE_x] = wheel_sticks ? 0.0 : wheel / INERTIA;
    rate[LOAD_x] = load_sticks || LOAD_HELD ? 0.0 : x[LOAD_RATE_x];
    rate[LOAD_RATE_x] = load_sticks || LOAD_HELD ? 0.0 : load / LOAD_INERTIA;
    if (N_STATES > WINDING_x) rsea_plant_further_rates(p, x, rate);
}
static void rsea_plant_step(const rsea_plant *p, double h, double *x) {
    static const double share[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double rate[MOST_STATES] = {0}, at[MOST_STATES] = {0}, sum[MOST_STATES] = {0};
    int stage, j;
    for (stage = 0; stage < 4; ++stage) {
        for (j = 0; j < N_STATES; ++j) at[j] = p->x[j] + share[stage] * h * rate[j];
        rsea_plant_rates(p, at, rate);
        for (j = 0; j < N_STATES; ++j) sum[j] += weight[stage] * rate[j];
    }
    for (j = 0; j < N_STATES; ++j) x[j] = p->x[j] + h / 6.0 * sum[j];
}
/* Whether the bridge returns current to the supply. */
static int rsea_plant_returns(const rsea_plant *p, const double *x) {
    const double flow = INDUCTANCE > 0.0 ? x[CURRENT_x] : rsea_plant_driving(p, x);
    return E_source_one_way != 0.0 && rsea_acting(p->command) * flow < 0.0;
}
/* How many of the spring's kinks a state is beyond. */
static int rsea_plant_knee(const double *x) {
    const double deflection = rsea_plant_deflection(x);
    int j, beyond = 0;
    for (j = 0; j < 4 && KNEES[1] != 0.0; ++j) beyond += deflection >= KNEES[j];
    return beyond;
}
/* Which switch must act at a state: 1 wheel, 2 load, 3 current limit, 4 contact, 5 sign of the
   spring's torque, 6 direction of the supply's current, 7 a kink of the spring; 0 none. */
static int rsea_plant_switch(const rsea_plant *p, const double *x) {
    double wheel, load;
    rsea_plant_pushes(p, x, &wheel, &load);
    if (GEAR_LOSS && p->torque_sign * rsea_plant_torque(x) < 0.0) return 5;
    if (WHEEL_DRY && (p->wheel ? p->wheel * x[WHEEL_RATE_x] < 0.0
                               : fabs(wheel) > rsea_plant_wheel_level(p, x, wheel)))
        return 1;
    if (LOAD_DRY && !LOAD_HELD && (p->load ? p->load * x[LOAD_RATE_x] < 0.0
                                           : fabs(load) > rsea_plant_load_level(x)))
        return 2;
    if (INDUCTANCE > 0.0 && (DRIVE == DUTY || DRIVE == VOLTAGE)
        && (p->limited ? p->limited * rsea_plant_current_rate(p, x) < 0.0
                       : fabs(x[CURRENT_x]) > CURRENT_LIMIT
                             || (fabs(x[CURRENT_x]) == CURRENT_LIMIT
                                 && x[CURRENT_x] * rsea_plant_current_rate(p, x) > 0.0)))
        return 3;
    if (p->contact != (x[LOAD_x] > CONTACT_ANGLE) && !LOAD_HELD) return 4;
    if (p->returns != rsea_plant_returns(p, x)) return 6;
    return p->knee != rsea_plant_knee(x) ? 7 : 0;
}
static void rsea_plant_act(rsea_plant *p, int which) {
    double wheel, load;
    if (which == 3) {
        p->limited = p->limited ? 0 : p->x[CURRENT_x] > 0.0 ? 1 : -1;
        if (p->limited) p->x[CURRENT_x] = p->limited * CURRENT_LIMIT;
    }
    if (which == 4) p->contact = !p->contact;
    if (which == 5) p->torque_sign = -p->torque_sign;
    if (which == 6) p->returns = !p->returns;
    if (which == 7) p->knee = rsea_plant_knee(p->x);
    if (which == 1) p->x[WHEEL_RATE_x] = 0.0;
    if (which == 2) p->x[LOAD_RATE_x] = 0.0;
    rsea_plant_pushes(p, p->x, &wheel, &load);
    if (which == 1)
        p->wheel = fabs(wheel) > rsea_plant_wheel_level(p, p->x, wheel) ? (wheel > 0.0 ? 1 : -1) : 0;
    if (which == 2) p->load = fabs(load) > rsea_plant_load_level(p->x) ? (load > 0.0 ? 1 : -1) : 0;
}
/* The modes at rest, for the angles and the command that are set. */
static void rsea_plant_start(rsea_plant *p) {
    p->contact = p->x[LOAD_x] > CONTACT_ANGLE && !LOAD_HELD;
    p->x[WINDING_x] = E_start_winding_rise;
    p->x[CASE_x] = E_start_case_rise;
    p->x[LINK_x] = p->x[LOAD_x];
    p->wheel = p->load = p->limited = p->returns = 0;
    p->knee = rsea_plant_knee(p->x);
    p->torque_sign = rsea_plant_torque(p->x) < 0.0 ? -1 : 1;
}
/* Move on by a time; 0 done, 1 too many switches or not finite. */
static int rsea_plant_advance(rsea_plant *p, double time_s) {
    double left = time_s, x[MOST_STATES];
    int switches = 0, which, j;
    for (j = 0; j < 7 && (which = rsea_plant_switch(p, p->x)) != 0; ++j) rsea_plant_act(p, which);
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
        for (j = 0; j < N_STATES; ++j) p->x[j] = x[j];
        left -= h;
        if (which) rsea_plant_act(p, which);
        if (!isfinite(p->x[WHEEL_RATE_x] + p->x[LOAD_RATE_x]) || (switches += which != 0) > 1000)
            return 1;
    }
    return 0;
}
