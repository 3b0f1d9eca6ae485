/* A 1 kHz loop around the controller, with a device to be filled in: three functions at the top.
 *
 *     cc -std=c11 -O2 example_loop.c -o example_loop -lm && ./example_loop 1.0
 *
 * For a system with clock_gettime and nanosleep (Linux, macOS). Deadlines are absolute: a late tick delays no other.
 */
#define _POSIX_C_SOURCE 200809L
#include "hapteq_controller.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* ---- your device ---- */

static int device_open(void) { return 1; }
static int device_send(const double force[HAPTEQ_INPUTS]) { (void)force; return 1; } /* 0: it is gone */
static void device_release(void) {} /* zero force, then brakes; also when the loop ends for any other reason */

/* ---- the loop ---- */

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void sleep_until(double due_s)
{
    const double left = due_s - now_s();
    if (left > 0.0) {
        const struct timespec nap = {(time_t)left, (long)(1e9 * (left - (double)(time_t)left))};
        nanosleep(&nap, NULL);
    }
}

int main(int count, char **words)
{
    const double duration_s = count > 1 ? atof(words[1]) : 1.0;
    const double normal[3] = {0.0, 0.6, 0.8}; /* of the contact */
    double rotation[HAPTEQ_DIRECTIONS], force[HAPTEQ_INPUTS], peak = 0.0, latest_s = 0.0;
    hapteq_transient transient;
    long ticks = 0;

    hapteq_rotation_to(normal, rotation);
    hapteq_transient_reset(&transient);
    if (!device_open())
        return 1;
    const double started_s = now_s();
    for (; (double)ticks < duration_s * HAPTEQ_RATE_HZ; ticks++) {
        const double due_s = started_s + (double)ticks / HAPTEQ_RATE_HZ;
        sleep_until(due_s);
        if (now_s() - due_s > latest_s)
            latest_s = now_s() - due_s;
        if (!hapteq_transient_tick(&transient, rotation, force))
            hapteq_transient_restart(&transient); /* once more: knock, knock */
        if (!device_send(force))
            break;
        for (int i = 0; i < HAPTEQ_INPUTS; i++)
            peak = fabs(force[i]) > peak ? fabs(force[i]) : peak;
    }
    device_release();
    printf("%ld ticks, largest force on an axis %.3f N, latest tick %.0f us, limited %lu times\n", ticks, peak,
           1e6 * latest_s, transient.limited);
    return 0;
}
