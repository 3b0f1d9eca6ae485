/* Plays both tick functions and compares with what Python gave: a difference above 1e-12 of the cap fails. Then it
 * says what a tick costs on this computer.
 *
 *     cc -std=c11 -O2 -Wall -Wextra -Werror -pedantic check_controller.c -o check_controller -lm && ./check_controller
 */
#include "hapteq_controller.h"

#include <stdio.h>
#include <time.h>

@CASES@

#define TOLERANCE (1e-12 * HAPTEQ_CAP_N)
#define BENCHMARK_TICKS 200000L

static double furthest(double so_far, const double *found, const double *right, int count)
{
    for (int i = 0; i < count; i++) {
        const double difference = fabs(found[i] - right[i]);
        if (!(difference <= so_far)) /* NaN is as far as can be */
            so_far = difference >= 0.0 ? difference : 1e300;
    }
    return so_far;
}

static double transient_difference(void)
{
    hapteq_transient transient;
    double force[HAPTEQ_INPUTS], largest = 0.0;
    hapteq_transient_reset(&transient);
    for (int k = 0; k < CASE_ROWS; k++) {
        hapteq_transient_tick(&transient, case_rotation[k], force);
        largest = furthest(largest, force, case_transient_force[k], HAPTEQ_INPUTS);
    }
    return largest;
}

static double stream_difference(void)
{
    hapteq_stream stream;
    double force[HAPTEQ_INPUTS], largest = 0.0;
    hapteq_stream_reset(&stream);
    for (int k = 0; k < CASE_ROWS; k++) {
        hapteq_stream_tick(&stream, case_wanted[k], force);
        largest = furthest(largest, force, case_stream_force[k], HAPTEQ_INPUTS);
        largest = furthest(largest, stream.low, case_low[k], HAPTEQ_OUTPUTS);
        largest = furthest(largest, stream.high, case_high[k], HAPTEQ_OUTPUTS);
    }
    return largest;
}

static double nanoseconds(clock_t taken)
{
    return 1e9 * (double)taken / CLOCKS_PER_SEC / (double)BENCHMARK_TICKS;
}

int main(void)
{
    const double transient = transient_difference(), stream = stream_difference();
    static hapteq_transient played;
    static hapteq_stream streamed;
    double force[HAPTEQ_INPUTS], sum = 0.0;

    printf("largest difference from Python: transient %.2g N, stream %.2g N; allowed %.2g N\n", transient, stream,
           TOLERANCE);
    clock_t start = clock();
    for (long k = 0; k < BENCHMARK_TICKS; k++) {
        if (!hapteq_transient_tick(&played, case_rotation[k % CASE_ROWS], force))
            hapteq_transient_restart(&played);
        sum += force[0];
    }
    const clock_t transient_ticks = clock() - start;
    start = clock();
    for (long k = 0; k < BENCHMARK_TICKS; k++) {
        hapteq_stream_tick(&streamed, case_wanted[k % CASE_ROWS], force);
        sum += force[0];
    }
    printf("a tick: transient %.0f ns, stream %.0f ns (sum %.3g)\n", nanoseconds(transient_ticks),
           nanoseconds(clock() - start), sum);
    return !(transient <= TOLERANCE && stream <= TOLERANCE);
}
