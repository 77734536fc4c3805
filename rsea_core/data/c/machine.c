/* The machine in C, for a bench without it: start, then advance with a command.
 *
 *     cc -std=c99 -O2 -ffp-contract=off STEM_loop.c STEM_plant.c -o loop -lm && ./loop replay.csv
 */
PLANT_HEADER
#include "STEM_plant.h"
static rsea_plant machine;
void rsea_machine_start(double motor_angle_rad, double load_angle_rad) {
    static const rsea_plant none;
    machine = none;
    machine.x[WHEEL_x] = motor_angle_rad / GEAR_RATIO;
    machine.x[LOAD_x] = load_angle_rad;
    rsea_plant_start(&machine);
}
int rsea_machine_advance(double command, double load_torque_Nm, double time_s) {
    machine.command = command;
    machine.load_torque_Nm = load_torque_Nm;
    return rsea_plant_advance(&machine, time_s);
}
double rsea_machine_motor_angle_rad(void) { return machine.x[WHEEL_x] * GEAR_RATIO; }
double rsea_machine_load_angle_rad(void) { return machine.x[LOAD_x]; }
double rsea_machine_torque_Nm(void) { return rsea_plant_torque(machine.x); }
double rsea_machine_current_A(void) { return rsea_plant_current(&machine, machine.x); }
