#include <math.h>
#include <mujoco/mujoco.h>
static double counted(double angle, double count) {
    return count > 0.0 ? floor(angle / count) * count : angle;
}
/* PI on the torque of a linear spring; numbers: stiffness, gear, count, kp, ki T, volts. */
void loop(const mjModel *m, mjData *d, int ticks, int steps, const double *n,
          const double *target, const double *given, double *torque) {
    double integral = 0.0;
    int row, j;
    mj_resetData(m, d);
    for (row = 0; row <= ticks; ++row) {
        const double wheel = counted(d->qpos[0] * n[1], n[2]) / n[1];
        const double load = counted(d->qpos[1], n[2]);
        torque[row] = n[0] * (d->qpos[0] - d->qpos[1]);
        if (given) {
            d->ctrl[0] = n[5] * given[row];
        } else {
            const double error = target[row] - n[0] * (wheel - load);
            double duty;
            integral += n[4] * error;
            duty = n[3] * error + integral;
            d->ctrl[0] = n[5] * (duty > 1.0 ? 1.0 : duty < -1.0 ? -1.0 : duty);
        }
        for (j = 0; j < steps; ++j) mj_step(m, d);
    }
}
