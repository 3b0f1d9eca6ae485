/* A 1 kHz loop around the controller, with a device to be filled in: three functions at the top.
 *
 *     cc -std=c11 -O2 example_loop.c -o example_loop -lm && ./example_loop 1.0
 *
 * For a system with clock_gettime and nanosleep (Linux, macOS). Deadlines are absolute: a late tick delays no other.
 * Ctrl-C, SIGTERM and SIGHUP end it with zero force. SIGKILL, and a computer that stands still, end no force: that takes
 * the device's own watchdog.
 */
#define _POSIX_C_SOURCE 200809L
#include "hapteq_controller.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define LATEST_S 0.02 /* a loop that is later than this stood still, and what the handle did meanwhile is not known */

/* ---- your device ---- */

static int device_open(void) { return 1; }
static int device_send(const double force[HAPTEQ_INPUTS]) { (void)force; return 1; } /* 0: it is gone */
static void device_release(void) {} /* brakes, where it has any; zero force was sent before */

/* ---- the loop ---- */

static volatile sig_atomic_t asked_to_end = 0;

static void ask_to_end(int number)
{
    (void)number;
    asked_to_end = 1;
}

static void listen_for_signals(void)
{
    const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction action;
    memset(&action, 0, sizeof action); /* no SA_RESTART: what waits is woken */
    action.sa_handler = ask_to_end;
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        sigaction(numbers[i], &action, NULL);
}

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void sleep_until(double due_s)
{
    double left = due_s - now_s();
    for (; left > 0.0 && !asked_to_end; left = due_s - now_s()) {
        const struct timespec nap = {(time_t)left, (long)(1e9 * (left - (double)(time_t)left))};
        nanosleep(&nap, NULL);
    }
}

int main(int count, char **words)
{
    const double duration_s = count > 1 ? atof(words[1]) : 1.0;
    const double normal[3] = {0.0, 0.6, 0.8}; /* of the contact */
    const double zero[HAPTEQ_INPUTS] = {0.0};
    double rotation[HAPTEQ_DIRECTIONS], force[HAPTEQ_INPUTS], peak = 0.0, late_s = 0.0, latest_s = 0.0;
    hapteq_transient transient;
    long ticks = 0, missed = 0;

    hapteq_rotation_to(normal, rotation);
    hapteq_transient_reset(&transient);
    listen_for_signals();
    if (!device_open())
        return 1;
    const double started_s = now_s();
    for (; (double)ticks < duration_s * HAPTEQ_RATE_HZ; ticks++) {
        const double due_s = started_s + (double)ticks / HAPTEQ_RATE_HZ;
        sleep_until(due_s);
        late_s = now_s() - due_s;
        latest_s = late_s > latest_s ? late_s : latest_s;
        if (asked_to_end || late_s > LATEST_S)
            break;
        /* Ticks that went by are not played one after the other now: the model takes them, the device does not. */
        const long went_by = late_s > 0.0 ? (long)(late_s * HAPTEQ_RATE_HZ) : 0;
        missed += went_by;
        ticks += went_by;
        for (long k = 0; k <= went_by; k++)
            if (!hapteq_transient_tick(&transient, rotation, force))
                hapteq_transient_restart(&transient); /* once more: knock, knock */
        if (!device_send(force))
            break;
        for (int i = 0; i < HAPTEQ_INPUTS; i++)
            peak = fabs(force[i]) > peak ? fabs(force[i]) : peak;
    }
    device_send(zero);
    device_release();
    printf("%ld ticks, %ld missed, largest force on an axis %.3f N, latest tick %.0f us, limited %lu times\n", ticks, missed,
           peak, 1e6 * latest_s, transient.limited);
    if (late_s > LATEST_S)
        printf("It stood still for too long: the force was set to zero, and the loop ended.\n");
    return late_s > LATEST_S;
}
