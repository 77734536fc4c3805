/* Closes the loop of law, guard and machine in C, the machine in steps of 0.1 ms, and compares with
 * the simulation; exit status 1 if a reading is further from it than encoder counts explain.
 */
#include <stdio.h>
#include <time.h>
#include "STEM.h"
#include "STEM_guard.h"
#include "STEM_plant.h"
#define STEP_s 1e-4
static double counted(double angle, double count) {
    return count > 0.0 ? floor(angle / count) * count : angle;
}
int main(int count, char **names) {
    static const double counts[2] = {MOTOR_COUNT, LOAD_COUNT}, bounds[2] = {MOTOR_BOUND, LOAD_BOUND};
    const int steps = (int)ceil(PERIOD_s / STEP_s - 1e-9);
    double r[7], worst[2] = {0.0, 0.0}, waiting = 0.0, spent = 0.0;
    char line[512];
    rsea_guard g;
    rsea_limits l = rsea_default_limits;
    int i, j, failed = 0;
    FILE *file = count > 1 ? fopen(names[1], "r") : NULL;
    if (file == NULL || fgets(line, (int)sizeof line, file) == NULL) return 2;
    l.motor_speed = l.load_speed = l.rate = (REAL)HUGE_VAL;
    l.continuous_A = l.thermal_s = (REAL)HUGE_VAL;
    l.blend_s = (REAL)0;
    rsea_guard_start(&g);
    rsea_machine_start(MOTOR_START, LOAD_START);
    for (i = 0; fgets(line, (int)sizeof line, file) != NULL; ++i) {
        double angle[2], command;
        clock_t begun;
        rsea_input y;
        if (sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf", r, r + 1, r + 2, r + 3, r + 4, r + 5, r + 6)
            != 7) return 2;
        angle[0] = counted(rsea_machine_motor_angle_rad(), counts[0]);
        angle[1] = counted(rsea_machine_load_angle_rad(), counts[1]);
        for (j = 0; j < 2; ++j) worst[j] = fmax(worst[j], fabs(angle[j] - r[4 + j]));
        y.reference = (REAL)r[1];
        y.reference_rate = (REAL)r[2];
        y.reference_acceleration = (REAL)r[3];
        y.motor_angle_rad = (REAL)angle[0];
        y.load_angle_rad = (REAL)angle[1];
        command = (double)rsea_guarded(&g, &l, &y, (REAL)PERIOD_s, (unsigned)i + 1u, 1);
        begun = clock();
        for (j = 0; j < steps && !failed; ++j)
            failed = rsea_machine_advance(LATE ? waiting : command, 0.0, PERIOD_s / steps);
        spent += (double)(clock() - begun) / CLOCKS_PER_SEC;
        waiting = command;
    }
    fclose(file);
    failed = failed || !(worst[0] <= bounds[0] && worst[1] <= bounds[1]);
    printf("%s: law, guard and machine in C within %.2g and %.2g rad of the simulation, motor and"
           " load (allowed %.2g and %.2g)\n", failed ? "FAIL" : "pass", worst[0], worst[1], bounds[0],
           bounds[1]);
    printf("the machine takes %.3g us for 0.1 ms\n", 1e6 * spent / i / steps);
    return failed;
}
