/* What a loop can do on this computer at best: a bare one in C, with nothing in its ticks but the time.
 * bare_loop SECONDS RATE_HZ PRIORITY (0: as other programs), prints: ticks, late ticks (missed ones among them), the
 * latest in s, and what it got: 0 no priority, 1 priority, 2 its memory locked too. Sleeps to 150 us before each deadline, then waits awake, as the
 * loop of a device does. A tick is late where its work ends after the next one is due.
 */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

static double now_s(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void sleep_until(double due_s) {
  double left_s = due_s - now_s();
  if (left_s <= 0) return;
  struct timespec t = {.tv_sec = (time_t)left_s, .tv_nsec = (long)(1e9 * (left_s - (double)(time_t)left_s))};
  while (nanosleep(&t, &t) && errno == EINTR) {}
}

int main(int count, char **words) {
  if (count != 4) return 2;
  double seconds = atof(words[1]), tick_s = 1 / atof(words[2]);
  struct sched_param first = {.sched_priority = atoi(words[3])};
  int granted = first.sched_priority > 0 && sched_setscheduler(0, SCHED_FIFO, &first) == 0;
  if (granted) granted = mlockall(MCL_CURRENT) ? 1 : 2;
  long ticks = 0, late = 0, total = (long)(seconds / tick_s);
  double latest_s = 0, started_s = now_s();
  while (ticks < total) {
    double first_s = started_s + (double)(ticks + 1) * tick_s;
    sleep_until(first_s - 150e-6);
    while (now_s() < first_s) {}
    long due = (long)((now_s() - started_s) / tick_s + 1e-6);
    if (due > total) due = total;
    if (due < ticks + 1) due = ticks + 1;
    late += due - ticks - 1;
    ticks = due;
    double done_s = now_s();
    late += done_s > started_s + (double)(due + 1) * tick_s;
    if (done_s - first_s > latest_s) latest_s = done_s - first_s;
  }
  printf("%ld %ld %.9f %d\n", ticks, late, latest_s, granted);
  return 0;
}
