/* Forces that make a haptic device accelerate as wanted, from the gains of one model of it.
 *
 * C11 and C++, no allocation, no locks, nothing but sqrt and memset of a library. Written by `hapteq export-controller`.
 *
 * hapteq_transient: the table of accelerations that was given at the export, turned at each tick by any rotation.
 * hapteq_stream:    accelerations that arrive tick by tick; what is played is the one that arrived
 *                   HAPTEQ_PREVIEW - 1 ticks ago.
 *
 * Call a tick function once per sample, HAPTEQ_RATE_HZ times a second, and send the force to the device. Each keeps the
 * length of its force below HAPTEQ_CAP_N and never gives a force that is no number. That is no safety layer: caps of the
 * sum of all forces, limits of position and speed, and a watchdog belong into the loop around it and into the device.
 */
#ifndef HAPTEQ_CONTROLLER_H
#define HAPTEQ_CONTROLLER_H

#include <math.h>
#include <string.h>

@TABLES@

/* Shorten to the cap, direction kept; zero if it is no force at all. Returns whether it was changed. */
static inline int hapteq_confine(double force[HAPTEQ_INPUTS])
{
    const double within = HAPTEQ_CAP_N * (1.0 - 1e-12);
    double square = 0.0;
    for (int i = 0; i < HAPTEQ_INPUTS; i++)
        square += force[i] * force[i];
    if (square <= within * within)
        return 0;
    const double share = square <= 1e200 ? within / sqrt(square) : 0.0; /* NaN compares as false */
    for (int i = 0; i < HAPTEQ_INPUTS; i++)
        force[i] = share > 0.0 ? share * force[i] : 0.0;
    return 1;
}

/* The model's next state, and what it answers at this tick. */
static inline void hapteq_advance(double x[HAPTEQ_STATES], const double force[HAPTEQ_INPUTS],
                                  double answer[HAPTEQ_OUTPUTS])
{
    double next[HAPTEQ_WIDTH] = {0.0}, from[HAPTEQ_DEPTH] = {0.0};
    memcpy(from, x, sizeof(double) * HAPTEQ_STATES);
    memcpy(from + HAPTEQ_STATES, force, sizeof(double) * HAPTEQ_INPUTS);
    for (int j = 0; j < HAPTEQ_DEPTH; j += 4) /* four rows at a time: next is loaded and stored a quarter as often */
        for (int c = 0; c < HAPTEQ_WIDTH; c++)
            next[c] += hapteq_step[j][c] * from[j] + hapteq_step[j + 1][c] * from[j + 1] +
                       hapteq_step[j + 2][c] * from[j + 2] + hapteq_step[j + 3][c] * from[j + 3];
    memcpy(x, next, sizeof(double) * HAPTEQ_STATES);
    memcpy(answer, next + HAPTEQ_STATES, sizeof(double) * HAPTEQ_OUTPUTS);
}

static inline int hapteq_all_finite(const double *values, int count)
{
    int finite = 1;
    for (int i = 0; i < count; i++)
        finite &= values[i] >= -1e100 && values[i] <= 1e100;
    return finite;
}

/* ---- a transient that is known beforehand ---- */

typedef struct {
    long row;                      /* the next one of the table */
    double x[HAPTEQ_STATES];       /* of the model */
    double answer[HAPTEQ_OUTPUTS]; /* m/s^2, what the model answered at the last tick */
    unsigned long limited;         /* ticks at which the cap was reached, or a number was none */
} hapteq_transient;

/* At rest, before the first row. */
static inline void hapteq_transient_reset(hapteq_transient *t)
{
    memset(t, 0, sizeof *t);
}

/* The first row comes next, from the present motion: what still rings of the former one is steered out. */
static inline void hapteq_transient_restart(hapteq_transient *t)
{
    t->row = 0;
}

/* One tick. rotation: row by row, from the frame of the table into that of the device; it may change at any tick.
 * force: N, the answer; zero after the last row. Returns 1 until the last row was played. */
static inline int hapteq_transient_tick(hapteq_transient *t, const double rotation[HAPTEQ_DIRECTIONS],
                                        double force[HAPTEQ_INPUTS])
{
    const int playing = t->row >= 0 && t->row < HAPTEQ_ROWS;
    const int sound = hapteq_all_finite(rotation, HAPTEQ_DIRECTIONS);
    for (int i = 0; i < HAPTEQ_INPUTS; i++) {
        force[i] = 0.0;
        if (!playing || !sound)
            continue;
        for (int c = 0; c < HAPTEQ_DIRECTIONS; c++)
            force[i] += hapteq_basis[t->row][i][c] * rotation[c];
        for (int c = 0; c < HAPTEQ_STATES; c++)
            force[i] -= hapteq_gains[t->row][i][c] * t->x[c];
    }
    t->limited += (unsigned long)(hapteq_confine(force) || !sound);
    hapteq_advance(t->x, force, t->answer);
    t->row += playing;
    return t->row < HAPTEQ_ROWS;
}

#if HAPTEQ_OUTPUTS == 3
/* The rotation that turns the table's last axis into a unit normal, such as that of a contact. */
static inline void hapteq_rotation_to(const double normal[3], double rotation[9])
{
    const double sign = normal[2] >= 0.0 ? 1.0 : -1.0; /* Duff et al., Building an orthonormal basis, revisited, 2017 */
    const double a = -1.0 / (sign + normal[2]), b = normal[0] * normal[1] * a;
    const double first[3] = {1.0 + sign * normal[0] * normal[0] * a, sign * b, -sign * normal[0]};
    const double second[3] = {b, sign + normal[1] * normal[1] * a, -normal[1]};
    for (int i = 0; i < 3; i++) {
        rotation[3 * i] = first[i];
        rotation[3 * i + 1] = second[i];
        rotation[3 * i + 2] = normal[i];
    }
}
#endif

/* ---- a stream, known a little ahead ---- */

#define HAPTEQ_POLES (HAPTEQ_SPLIT_TERMS * HAPTEQ_SPLIT_ORDER)

typedef struct {
    double pole[HAPTEQ_SPLITS][HAPTEQ_POLES][HAPTEQ_OUTPUTS]; /* of the band split */
    double known[2 * HAPTEQ_PREVIEW][HAPTEQ_OUTPUTS];         /* the middle band, twice, so that a window is in one piece */
    int newest;                                               /* where the next one goes */
    double x[HAPTEQ_STATES];                                  /* of the model */
    double low[HAPTEQ_OUTPUTS], high[HAPTEQ_OUTPUTS];         /* m/s^2: of what has just arrived, not played */
    double answer[HAPTEQ_OUTPUTS];                            /* m/s^2, what the model answered at the last tick */
    unsigned long limited;                                    /* ticks at which the cap was reached, or a number was none */
} hapteq_stream;

static inline void hapteq_stream_reset(hapteq_stream *s)
{
    memset(s, 0, sizeof *s);
}

/* What of x lies above a crossover: the half of (q + (1 - q))^order with the higher powers of 1 - q. */
static inline void hapteq_above(double pole[HAPTEQ_POLES][HAPTEQ_OUTPUTS], const double filter[3],
                                const double x[HAPTEQ_OUTPUTS], double above[HAPTEQ_OUTPUTS])
{
    for (int c = 0; c < HAPTEQ_OUTPUTS; c++)
        above[c] = 0.0;
    for (int term = 0; term < HAPTEQ_SPLIT_TERMS; term++)
        for (int c = 0; c < HAPTEQ_OUTPUTS; c++) {
            double part = x[c];
            for (int stage = 0; stage < HAPTEQ_SPLIT_ORDER; stage++) {
                double *z = &pole[term * HAPTEQ_SPLIT_ORDER + stage][c];
                const double q = filter[0] * part + *z;
                *z = filter[1] * part - filter[2] * q;
                part = stage < HAPTEQ_SPLIT_TERMS - 1 - term ? q : part - q;
            }
            above[c] += hapteq_split_weight[term] * part;
        }
}

/* One tick. wanted: m/s^2, the newest sample. force: N, for the sample that came HAPTEQ_PREVIEW - 1 ticks ago.
 * What is no number counts as zero. */
static inline void hapteq_stream_tick(hapteq_stream *s, const double wanted[HAPTEQ_OUTPUTS], double force[HAPTEQ_INPUTS])
{
    const int sound = hapteq_all_finite(wanted, HAPTEQ_OUTPUTS);
    double rest[HAPTEQ_OUTPUTS], above[HAPTEQ_OUTPUTS];
    for (int c = 0; c < HAPTEQ_OUTPUTS; c++) {
        rest[c] = sound ? wanted[c] : 0.0;
        s->low[c] = s->high[c] = 0.0;
    }
#if HAPTEQ_HAS_HIGH
    hapteq_above(s->pole[0], hapteq_high_filter, rest, s->high);
    for (int c = 0; c < HAPTEQ_OUTPUTS; c++)
        rest[c] -= s->high[c];
#endif
#if HAPTEQ_HAS_LOW
    hapteq_above(s->pole[HAPTEQ_SPLITS - 1], hapteq_low_filter, rest, above);
    for (int c = 0; c < HAPTEQ_OUTPUTS; c++) {
        s->low[c] = rest[c] - above[c];
        rest[c] -= s->low[c];
    }
#else
    (void)above;
#endif
    for (int c = 0; c < HAPTEQ_OUTPUTS; c++)
        s->known[s->newest][c] = s->known[s->newest + HAPTEQ_PREVIEW][c] = rest[c];
    s->newest = (s->newest + 1) % HAPTEQ_PREVIEW;

    double along_x = 0.0, along_y = 0.0, along_z = 0.0;
    for (int j = 0; j < HAPTEQ_PREVIEW; j++) { /* the oldest sample first: it is the one that is played */
        const double *sample = s->known[s->newest + j];
        const double(*weight)[HAPTEQ_OUTPUTS] = hapteq_ahead[j];
        along_x += weight[0][0] * sample[0] + weight[0][1] * sample[1] + weight[0][2] * sample[2];
        along_y += weight[1][0] * sample[0] + weight[1][1] * sample[1] + weight[1][2] * sample[2];
        along_z += weight[2][0] * sample[0] + weight[2][1] * sample[1] + weight[2][2] * sample[2];
    }
    for (int c = 0; c < HAPTEQ_STATES; c++) {
        along_x -= hapteq_gain[0][c] * s->x[c];
        along_y -= hapteq_gain[1][c] * s->x[c];
        along_z -= hapteq_gain[2][c] * s->x[c];
    }
    force[0] = along_x;
    force[1] = along_y;
    force[2] = along_z;
    s->limited += (unsigned long)(hapteq_confine(force) || !sound);
    hapteq_advance(s->x, force, s->answer);
}

#endif
