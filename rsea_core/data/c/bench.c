/* Replays a simulated run and hurts it; exit status 1 if an answer is not what it must be.
 *
 *     cc -std=c99 -O1 -ffp-contract=off STEM_bench.c -o bench -lm && ./bench replay.csv log.csv
 *
 * A row of replay.csv: time_s, reference and its two derivatives, both readings, the command.
 */
#include <stdio.h>
#include <string.h>
#include "STEM.h"
#include "STEM_guard.h"
#include "STEM_log.h"
#define MOST_ROWS ROWS
static double rows[MOST_ROWS][7];
static int n, wrong;

static rsea_input input_of(const double *row) {
    rsea_input y;
    y.reference = (REAL)row[1];
    y.reference_rate = (REAL)row[2];
    y.reference_acceleration = (REAL)row[3];
    y.motor_angle_rad = (REAL)row[4];
    y.load_angle_rad = (REAL)row[5];
    return y;
}
static void check(int good, const char *what) {
    printf("%s: %s\n", good ? "pass" : "FAIL", what);
    if (!good) wrong = 1;
}
static rsea_limits open_limits(void) {
    rsea_limits l = rsea_default_limits;
    l.motor_speed = l.load_speed = l.rate = l.torque_Nm = l.highest_rad = (REAL)HUGE_VAL;
    l.continuous_A = l.thermal_s = (REAL)HUGE_VAL;
    l.lowest_rad = (REAL)-HUGE_VAL;
    l.blend_s = (REAL)0;
    return l;
}
/* One fault at `at`, `length` samples long; the guard must name it and hold or trip as it should. */
static void hurt(rsea_fault fault, int at, int length, int trips, const char *what) {
    rsea_guard g;
    rsea_limits l = open_limits();
    double before = 0.0, given = 0.0;
    int i, named = 1, held = 1;
    l.motor_speed = rsea_default_limits.motor_speed;
    l.load_speed = rsea_default_limits.load_speed;
    rsea_guard_start(&g);
    for (i = 0; i < n && i < at + length; ++i) {
        rsea_input y = input_of(rows[i]);
        REAL dt = (REAL)PERIOD_s;
        unsigned count = (unsigned)i + 1u;
        if (i >= at) {
            if (fault == rsea_not_finite) y.motor_angle_rad = (REAL)NAN;
            if (fault == rsea_jump) y.motor_angle_rad += (REAL)1000;
            if (fault == rsea_old) count = (unsigned)at;
            if (fault == rsea_late) dt = (REAL)(1.01 * PERIOD_s * (1.0 + (double)l.dt_share));
        }
        given = (double)rsea_guarded(&g, &l, &y, dt, count, 1);
        if (i >= at && g.tripped == rsea_good && given != before) held = 0;
        if (i >= at && g.fault != fault) named = 0;
        if (i < at) before = given;
    }
    check(named && (trips ? g.tripped == fault && !(given < 0.0 || given > 0.0)
                          : g.tripped == rsea_good && held), what);
}
/* A fault that must zero the command at once. */
static void limit(rsea_fault fault, const char *what) {
    rsea_guard g;
    rsea_limits l = open_limits();
    rsea_input y = input_of(rows[n - 1]);
    REAL dt = (REAL)PERIOD_s, given;
    rsea_guard_start(&g);
    rsea_guarded(&g, &l, &y, dt, 1u, 1);
    if (fault == rsea_late) dt = (REAL)2 * l.watchdog_s;
    if (fault == rsea_over_torque) l.torque_Nm = (REAL)-1;
    if (fault == rsea_over_travel) l.highest_rad = y.load_angle_rad - (REAL)1;
    if (fault == rsea_over_heat) {
        l.continuous_A = (REAL)1;
        g.heat = (REAL)4;
    }
    given = rsea_guarded(&g, &l, &y, dt, 2u, 1);
    check(g.tripped == fault && !(given < (REAL)0 || given > (REAL)0), what);
}
static int read_rows(const char *name) {
    FILE *file = fopen(name, "r");
    char line[512];
    if (file == NULL || fgets(line, (int)sizeof line, file) == NULL) return 0;
    while (n < MOST_ROWS && fgets(line, (int)sizeof line, file) != NULL) {
        double *r = rows[n];
        if (sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf", r, r + 1, r + 2, r + 3, r + 4, r + 5, r + 6)
            == 7) ++n;
    }
    fclose(file);
    return n > 20;
}
int main(int count, char **names) {
    rsea_guard g;
    rsea_limits l = open_limits();
    double worst = 0.0, acting = 0.0, most = 0.0, last = 0.0, step;
    FILE *log;
    int i;
    if (count != 3 || !read_rows(names[1]) || (log = fopen(names[2], "w")) == NULL) {
        fprintf(stderr, "bench REPLAY.csv LOG.csv: the first must be readable, the second new\n");
        return 2;
    }
    rsea_log_head(log);
    rsea_guard_start(&g);
    for (i = 0; i < n; ++i) {
        rsea_input y = input_of(rows[i]);
        double given = (double)rsea_guarded(&g, &l, &y, (REAL)PERIOD_s, (unsigned)i + 1u, 1);
        double off = given > rows[i][6] ? given - rows[i][6] : rows[i][6] - given;
        if (!(off <= worst)) worst = off;
        rsea_log_row(log, rows[i][0], LATE ? acting : given, rows[i][4], rows[i][5], 1);
        acting = given;
    }
    fclose(log);
    printf("replay of %d samples: largest error %.3g (allowed BOUND)\n", n, worst);
    check(worst <= BOUND, "the simulated commands");
    hurt(rsea_not_finite, 10, 1, 0, "a reading that is no number: held");
    hurt(rsea_jump, 10, 1, 0, "a jump: held");
    hurt(rsea_old, 10, 1, 0, "an old reading: held");
    hurt(rsea_late, 10, 1, 0, "a late sample: held");
    i = rsea_default_limits.most_held + 1;
    hurt(rsea_not_finite, 5, i, 1, "no numbers for long: command zero");
    hurt(rsea_jump, 5, i, 1, "a jump that stays: command zero");
    hurt(rsea_old, 5, i, 1, "old readings for long: command zero");
    limit(rsea_late, "no call for longer than the watchdog: command zero");
    limit(rsea_over_torque, "torque beyond its limit: command zero");
    limit(rsea_over_travel, "travel beyond its limit: command zero");
    limit(rsea_over_heat, "mean square of the current beyond its limit: command zero");
    l.blend_s = rsea_default_limits.blend_s;
    l.rate = rsea_default_limits.rate;
    rsea_guard_start(&g);
    for (i = 0; i < n; ++i) { /* enabled in the middle of a run, the readings as they stand there */
        rsea_input y = input_of(rows[n / 2]);
        double given = (double)rsea_guarded(&g, &l, &y, (REAL)PERIOD_s, (unsigned)i + 1u, 1);
        step = given > last ? given - last : last - given;
        if (step > most) most = step;
        last = given;
    }
    check(most <= 1.0001 * (double)l.rate * PERIOD_s, "enabled: no change beyond the rate");
    {
        rsea_input y = input_of(rows[n / 2]);
        REAL off = rsea_guarded(&g, &l, &y, (REAL)PERIOD_s, 1u, 0);
        check(!(off < (REAL)0 || off > (REAL)0) && !g.running, "not enabled: command zero");
    }
    return wrong;
}
