/* A recording as `dftfs diagnose` reads it: the command that acts from this row on, readings. */
static inline int rsea_log_head(FILE *file) {
    return fputs("time_s,COMMAND_NAME,motor_angle_rad,load_angle_rad,drive_enabled\n", file);
}
static inline int rsea_log_row(
    FILE *file, double time_s, double command, double motor_rad, double load_rad, int enabled) {
    return fprintf(
        file, "%.9g,%.9g,%.9g,%.9g,%d\n", time_s, command, motor_rad, load_rad, enabled != 0);
}
