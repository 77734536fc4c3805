/* Laws of the effects, over their numbers E_... (zero: absent); the same as in rsea_core/effects.

   All torques at the output side of the gear. */
/* What the drive makes of a command. */
static double rsea_acting(double command) {
    command += E_command_offset;
    if (E_rounded_dead_zone != 0.0)
        command -= E_rounded_dead_zone * tanh(command / E_rounded_dead_zone);
    if (E_command_threshold != 0.0)
        command *= 0.5 + 0.5 * tanh((fabs(command) / E_command_threshold - 1.0) / 0.03);
    if (fabs(command) <= E_dead_zone) command = 0.0;
    else command -= command > 0.0 ? E_dead_zone : -E_dead_zone;
    command += E_offset_after_dead_zone;
    return command + (E_command_gain_by_sign + E_command_gain_by_size * command) * fabs(command)
        + E_command_gain_by_square * command * command * command;
}
/* Factor on k_t and k_e, over the wheel's angle and the rises of temperature. */
static double rsea_constant_factor(double wheel, double winding, double body) {
    return (1.0 - E_torque_constant_fall * body - E_torque_constant_fall_by_winding * winding)
        * (1.0 + E_ripple_fraction * sin(E_ripple_cycles_at_output * wheel + E_ripple_phase));
}
/* What supply sag adds to the winding's resistance; `returns`: the bridge returns current. */
static double rsea_source(double command, int returns) {
    const double size = fabs(command);
    const double share = size * (size + E_source_ripples * (1.0 - size));
    return share * (returns ? 1.0 - E_source_one_way : 1.0) * E_source_resistance;
}
static double rsea_dead_time_volts(double current) {
    return E_dead_time_duty != 0.0
        ? E_dead_time_duty * VOLTS_PER_COMMAND * tanh(current / E_dead_time_current) : 0.0;
}
/* The current of a winding without inductance: R i + dead time's loss = volts, by Newton. */
static double rsea_static_current(double volts, double resistance) {
    const double wanted = fabs(volts), lost = E_dead_time_duty * VOLTS_PER_COMMAND;
    double current = (wanted > lost ? wanted - lost : 0.0) / resistance;
    int j;
    if (E_dead_time_duty == 0.0) return volts / resistance;
    for (j = 0; j < 60; ++j) {
        const double share = tanh(current / E_dead_time_current);
        const double slope = resistance + lost * (1.0 - share * share) / E_dead_time_current;
        const double step = (wanted - resistance * current - lost * share) / slope;
        current += step;
        if (fabs(step) <= 1e-15 * current) break;
    }
    return volts > 0.0 ? current : -current;
}
/* Terms of a formula: coefficients, functions of the angle and of the speed (in usual ones). */
static double rsea_formula(const double *terms, const double *angles, const double *speeds,
                           double usual, double angle, double speed) {
    const double share = speed / usual;
    double sum = 0.0;
    int j;
    for (j = 0; j < N_TERMS; ++j) {
        const double kind = angles[j], of_speed = speeds[j];
        const double by_angle = kind < 4.0 ? pow(angle, kind)
            : kind < 20.0 ? sin((kind - 10.0) * angle) : cos((kind - 20.0) * angle);
        const double by_speed = of_speed == 0.0 ? 1.0 : of_speed == 1.0 ? tanh(share / SMOOTH)
            : of_speed == 2.0 ? share : share * fabs(share);
        if (terms[j] != 0.0) sum += terms[j] * by_angle * by_speed;
    }
    return sum;
}
/* Torque on the wheel by its angle and speed: cogging, smooth friction, a formula. */
static double rsea_wheel_torque(double wheel, double speed) {
    double torque = -E_gear_offset - E_gear_viscous * speed - E_gear_viscous_skew * fabs(speed);
    if (E_cogging_torque != 0.0)
        torque -= E_cogging_torque * sin(E_cogging_cycles_at_output * wheel + E_cogging_phase);
    if (E_cogging_torque_2 != 0.0)
        torque -= E_cogging_torque_2
            * sin(E_cogging_cycles_2_at_output * wheel + E_cogging_phase_2);
    if (E_cogging_torque_3 != 0.0)
        torque -= E_cogging_torque_3
            * sin(E_cogging_cycles_3_at_output * wheel + E_cogging_phase_3);
    if (E_gear_atan_level != 0.0)
        torque -= E_gear_atan_level * atan(speed / E_gear_atan_velocity);
    if (E_formula_gear_usual != 0.0)
        torque += rsea_formula(GEAR_TERMS, GEAR_ANGLES, GEAR_SPEEDS, E_formula_gear_usual,
                               wheel, speed);
    return torque;
}
/* The gear's position error at a wheel angle, and its slope. */
static double rsea_gear_error(double wheel) {
    const double worm = GEAR_RATIO * wheel;
    return E_wheel_error * sin(E_wheel_error_cycles * wheel + E_wheel_error_phase)
        + E_worm_error * sin(worm + E_worm_error_phase)
        + E_wheel_error_2 * sin(2.0 * wheel + E_wheel_error_2_phase)
        + E_worm_error_2 * sin(2.0 * worm + E_worm_error_2_phase)
        + E_worm_error_3 * sin(3.0 * worm + E_worm_error_3_phase) - E_gear_error_at_zero;
}
static double rsea_gear_error_slope(double wheel) {
    const double worm = GEAR_RATIO * wheel;
    return E_wheel_error_cycles * E_wheel_error
        * cos(E_wheel_error_cycles * wheel + E_wheel_error_phase)
        + GEAR_RATIO * E_worm_error * cos(worm + E_worm_error_phase)
        + 2.0 * E_wheel_error_2 * cos(2.0 * wheel + E_wheel_error_2_phase)
        + 2.0 * GEAR_RATIO * E_worm_error_2 * cos(2.0 * worm + E_worm_error_2_phase)
        + 3.0 * GEAR_RATIO * E_worm_error_3 * cos(3.0 * worm + E_worm_error_3_phase);
}
/* Level of the gear's dry friction that slides (or is about to) one way, under a spring torque. */
static double rsea_gear_level(double way, double speed, double torque, int torque_sign) {
    double level = way > 0.0 ? E_gear_coulomb_forward : E_gear_coulomb_backward;
    if (E_gear_stribeck_rise != 0.0) {
        const double share = fabs(speed / E_gear_stribeck_velocity);
        const double shape = E_gear_stribeck_shape > 0.0 ? E_gear_stribeck_shape : 2.0;
        level *= 1.0 + E_gear_stribeck_rise * exp(-pow(share, shape));
    }
    return level + (way * torque_sign > 0.0 ? E_gear_drive_loss : E_gear_backdrive_loss)
        * torque_sign * torque;
}
/* Level of the load's dry friction, by its angle from where it hangs. */
static double rsea_load_level(double hanging, double speed) {
    double level = E_load_coulomb;
    if (E_load_stribeck_rise > 0.0) {
        const double share = speed / E_load_stribeck_velocity;
        level *= 1.0 + E_load_stribeck_rise * exp(-share * share);
    }
    if (E_load_normal_friction > 0.0) {
        const double along = E_load_mass_lever * speed * speed + E_load_weight * cos(hanging);
        level += E_load_normal_friction * hypot(along, E_load_weight * sin(hanging));
    }
    if (E_angle_friction > 0.0) {
        const double share = 1.0 + E_angle_friction_sine * sin(hanging)
            + E_angle_friction_cosine * cos(hanging);
        level += E_angle_friction * (share > 0.0 ? share : 0.0);
    }
    return level;
}
/* The cubic B-spline over the load's angle. */
static double rsea_position_torque(double angle) {
    const double u = (angle - E_position_first) / E_position_step, floor_u = floor(u);
    const double f = u - floor_u, g = 1.0 - f;
    const double weight[4] = {g * g * g, f * f * (3.0 * f - 6.0) + 4.0,
                              g * g * (3.0 * g - 6.0) + 4.0, f * f * f};
    double value = 0.0;
    int j;
    if (!(u > -2.0 && u < N_POSITIONS + 1.0)) return 0.0;
    for (j = 0; j < 4; ++j) {
        const int node = (int)floor_u - 1 + j;
        if (node >= 0 && node < N_POSITIONS) value += POSITION_TORQUE[node] * weight[j];
    }
    return value / 6.0;
}
/* Drag of the load over its speed; E_load_drag_beyond_square: its power less two. */
static double rsea_drag_damping(double speed) {
    const double size = fabs(speed);
    if (E_load_drag_beyond_square == 0.0 || size == 0.0) return E_load_drag * size;
    return E_load_drag * size * pow(size / 5.0, E_load_drag_beyond_square);
}
/* Smooth torque on the load by its angle and speed. */
static double rsea_load_torque(double angle, double speed) {
    const double parallel = angle - E_parallel_rest_angle;
    double torque = -rsea_drag_damping(speed) * speed
        - E_parallel_stiffness * parallel;
    if (E_parallel_cubic != 0.0) {
        double cubic = parallel < E_parallel_up_to ? parallel : E_parallel_up_to;
        if (cubic < -E_parallel_up_to) cubic = -E_parallel_up_to;
        torque -= E_parallel_cubic * cubic * cubic * (3.0 * parallel - 2.0 * cubic);
    }
    if (E_unbalance_torque != 0.0) torque -= E_unbalance_torque * sin(angle + E_unbalance_angle);
    if (E_position_step != 0.0) torque += rsea_position_torque(angle);
    if (E_formula_load_usual != 0.0)
        torque += rsea_formula(LOAD_TERMS, LOAD_ANGLES, LOAD_SPEEDS, E_formula_load_usual,
                               angle, speed);
    return torque;
}
/* Torque of the contact, against the load. */
static double rsea_contact(double depth, double speed) {
    double elastic, loss;
    if (E_contact_exponent == 0.0) return CONTACT_STIFFNESS * depth + CONTACT_DAMPING * speed;
    if (depth <= 0.0) return CONTACT_DAMPING * speed;
    elastic = CONTACT_STIFFNESS * E_contact_reference_depth
        * pow(depth / E_contact_reference_depth, E_contact_exponent);
    loss = E_contact_loss_factor * speed;
    return elastic * (1.0 + (loss > -1.0 ? loss : -1.0)) + CONTACT_DAMPING * speed;
}
