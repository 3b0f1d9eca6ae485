/* A stand-in for the vendor's device library, for tests only: ours, made from the public names and types of its
 * functions. Behind them a mass on a damper and a spring in wall time or stepped time, a firmware with watchdog and
 * brakes, and faults by switch: stub_set("name", value), or HAPTEQ_STUB="name=value,name=value" in the environment.
 * HAPTEQ_STUB_FILE names a file in which the device lives: for all programs that look at it, and on when the one that
 * drives it is killed. stretch_in_use is as watchdog_stretch, from the first force after opening on.
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>
#endif

#define SWITCHES(X)                                                                                                    \
  X(devices, 1) X(type, 33) X(sdk_minor, 17) X(firmware, 2.41) X(serial_told, 1) X(serial_no, 4242) X(in_use, 0) X(open_fails, 0) X(calibrated, 1) X(powered, 1)              \
  X(wall_time, 1) X(mass, 0.25) X(damping, 2) X(stiffness, 0) X(weight, 0) X(max_n, 12)                                \
  X(watchdog_works, 1) X(watchdog_settable, 1) X(watchdog_stretch, 1) X(latches, 1) X(force_enables, 1)                \
  X(unplugged, 0) X(unwritten, 0) X(untold, 0) /* position; status and force: answered and never written */ X(stale_every, 0) X(frozen, 0) X(jump_m, 0) X(no_number, 0) X(scaled_from_n, 1e9)                    \
  X(late_every, 0) X(late_s, 0) X(write_fails, 0) X(read_fails, 0) X(stop_fails, 0) X(buttons, 0)                      \
  X(off_by, 0) X(reset_after_s, 0) X(stretch_in_use, 1)                                                                \
  /* Faults that come and go: 0 = always; else only each so many-th reading or force. */                               \
  X(jump_every, 0) X(scaled_every, 0) X(frozen_axis, 0) X(write_late_every, 0) X(write_late_s, 0) X(status_late_s, 0) X(cap_works, 1) X(gain_told, 1)                   \
  X(stop_ignored, 0) X(told_speed, 1) X(told_bias, 0) /* the velocity told is so many times the true one, and offset, m/s */ X(silent_bias, 0) /* force along x on top, N */ X(brakes_told, 0) /* dhdStop answered and not done; brakes on, and force on, as it says */ X(told_nan, 0) /* reports to come that are NaN */ \
  X(answer_of_errors, -1) /* of functions that fail */ X(keeps_force, 0) /* a zero is answered and not given */                               \
  X(silent_gain, 1) X(told_step, 0) X(told_noise, 0) X(told_lift, 0) /* scaled without a word; the reported force in steps, with noise (rms), N; its weight held up */ \
  X(silently_n, 1e9) /* a cap of its own, of which no answer says anything */ X(turned, 0) /* force the other way */                                                                  \
  /* What wears: Coulomb friction in N, amplifiers, a mass that swings on the handle. */                               \
  X(friction, 0) X(gain, 1) X(mode_hz, 0) X(mode_kg, 0.02)                                                             \
  /* What its linkage says (dhd_linkage.h): a heavier second arm, its share; faults; where its reach ends. */           \
  X(odd_arm, 0) X(bad_jacobian, 0) X(bad_inertia, 0) X(reach_z_m, 0) X(frame_off_m, 0) X(linkage_turned_deg, 0)        \
  /* What a test may ask for. */                                                                                       \
  X(force_on, 0) X(brake, 1) X(cause, 0) X(fx, 0) X(fy, 0) X(fz, 0) X(peak_n, 0) X(writes, 0) X(opened, 0)             \
  X(stops, 0) X(closes, 0) X(reads, 0) X(watchdog, 0) X(cap_n, -1) X(effector, 0) X(gravity, 1) X(guard, 1)            \
  X(noise, 0) /* rms of each reading of the sensor, m/s^2 */                                                           \
  X(expert, 0) X(resetting, 0) X(now, 0) X(ax, 0) X(ay, 0) X(az, 0) X(enables, 0) X(last_write, 0) X(zeroed_s, 0) X(braked_s, 0) /* when it got the first zero, and braked */

#define AS_ENUM(name, value) name,
#define AS_VALUE(name, value) value,
#define AS_NAME(name, value) #name,
enum { SWITCHES(AS_ENUM) COUNT };
typedef struct {
  double values[COUNT], position[3], velocity[3], commanded[3], told[3], swung[3], swinging[3], started, integrated, commanded_at, reset_at;
  double used; /* Since it was opened, a force was sent. */
  char failing[40], late[40]; /* Names of functions: see stub_fail and stub_delay. */
  double failing_code, failures_left, delay_s, delays_left;
} Device;
static Device own = {.values = {SWITCHES(AS_VALUE)}, .started = -1};
static Device *device = &own;
#define p device->values
#define x device->position
#define v device->velocity
#define command device->commanded
#define shown device->told
#define w device->swung
#define u device->swinging
#define started_s device->started
#define integrated_s device->integrated
#define last_command_s device->commanded_at
#define reset_s device->reset_at
static const char *const names[COUNT] = {SWITCHES(AS_NAME)};

enum { OTHER = 1, COM = 2, NO_DEVICE = 5, TIMEOUT = 7, EXPERT_OFF = 9, NOT_IMPLEMENTED = 10, NOT_READY = 12, IN_USE = 20 };
static const char *const texts[] = {"no error", "error", "communication error", "busy", "no driver found",
  "no device found", "not available", "timeout", "geometry error", "expert mode disabled", "not implemented",
  "out of memory", "device not ready", "file not found", "configuration error", "invalid index", "deprecated",
  "null argument", "redundant encoders disagree", "not enabled", "device in use", "invalid", "no regulation"};

static _Thread_local int last_error;
static atomic_flag busy = ATOMIC_FLAG_INIT;

static double wall_s(void) {
  struct timespec t;
  timespec_get(&t, TIME_UTC);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Programs that share the device take turns, a call each. The system takes the lock from one that was killed; one that
 * was stopped in the middle of a call is not waited for. */
static int shared_file = -1;
#ifdef _WIN32
enum { F_WRLCK, F_UNLCK };
#endif
static int turn(short kind) {
#ifndef _WIN32
  struct flock whole = {.l_type = kind, .l_whence = SEEK_SET};
  return fcntl(shared_file, F_SETLK, &whole) == 0 || (errno != EAGAIN && errno != EACCES);
#else
  return kind == kind;
#endif
}
static void lock(void) {
  while (atomic_flag_test_and_set(&busy)) {}
  if (shared_file < 0) return;
  double until_s = wall_s() + 0.02;
  while (!turn(F_WRLCK) && wall_s() < until_s) {}
}
static void unlock(void) {
  if (shared_file >= 0) turn(F_UNLCK);
  atomic_flag_clear(&busy);
}
static int find(const char *name, size_t length) {
  for (int i = 0; i < COUNT; i++)
    if (strlen(names[i]) == length && !strncmp(names[i], name, length)) return i;
  return -1;
}

static void share(void) {
#ifndef _WIN32
  const char *name = getenv("HAPTEQ_STUB_FILE");
  int file = name && device == &own ? open(name, O_RDWR | O_CREAT, 0600) : -1;
  if (file < 0) return;
  int fresh = lseek(file, 0, SEEK_END) == 0;
  void *place = ftruncate(file, sizeof own) ? MAP_FAILED : mmap(0, sizeof own, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (place == MAP_FAILED) abort();
  shared_file = file;
  device = place;
  if (fresh) *device = own;
#endif
}

static void start(void) {
  share();
  if (started_s >= 0) return;
  started_s = wall_s();
  const char *at = getenv("HAPTEQ_STUB");
  while (at && *at) {
    const char *equals = strchr(at, '='), *comma = strchr(at, ',');
    if (!equals) break;
    int i = find(at, (size_t)(equals - at));
    if (i >= 0) p[i] = atof(equals + 1);
    at = comma ? comma + 1 : NULL;
  }
}

static void drop(int cause_of_drop) {
  if (!p[brake]) p[braked_s] = p[now];
  p[force_on] = 0, p[brake] = 1, p[cause] = cause_of_drop;
}

/* One tenth of a millisecond of device and firmware. */
static void step(double dt) {
  double norm = 0;
  if (p[force_on] && p[watchdog] > 0 && p[watchdog_works] &&
      p[now] - last_command_s > p[watchdog] * 125e-6 * p[watchdog_stretch] * (device->used ? p[stretch_in_use] : 1))
    drop(3);
  if (p[off_by]) drop((int)p[off_by]);
  for (int i = 0; i < 3; i++) {
    double applied = p[force_on] && !p[brake] ? command[i] + (i ? 0 : p[silent_bias]) : 0;
    double lift = p[gravity] && p[force_on] ? 9.81 * p[effector] : 0, down = i == 2 && p[weight] > 0 ? p[weight] - lift : 0;
    double rate = 2 * 3.14159265358979 * p[mode_hz], pull = p[mode_kg] * (rate * rate * (w[i] - x[i]) + 0.08 * rate * (u[i] - v[i]));
    double force = p[gain] * applied - (p[damping] + (p[brake] ? 20 : 0)) * v[i] - p[stiffness] * x[i] - down;
    force += pull - p[friction] * tanh(1000 * v[i]); /* creeps where it would stick, as before a real break-away */
    u[i] -= dt * pull / p[mode_kg], w[i] += dt * u[i];
    p[fx + i] = applied, p[ax + i] = force / p[mass];
    v[i] += dt * p[ax + i], x[i] += dt * v[i];
    norm += applied * applied;
  }
  p[peak_n] = fmax(p[peak_n], sqrt(norm));
}

static void run_to(double seconds) {
  if (seconds - integrated_s > 0.5) integrated_s = seconds - 0.5;
  while (integrated_s < seconds) {
    double dt = fmin(1e-4, seconds - integrated_s);
    integrated_s += dt, p[now] = integrated_s;
    step(dt);
  }
}

static void catch_up(void) {
  start();
  if (p[wall_time]) run_to(wall_s() - started_s);
}

static int is_due(double count, double every) { return every <= 0 || fmod(count, every) == 0; }
static void come_late(double count, double every, double late) {
  if (every > 0 && is_due(count, every)) {
    double until_s = wall_s() + late;
    while (wall_s() < until_s) {}
  }
}

static int fail(int code) { last_error = code; return (int)p[answer_of_errors]; }
static int answer(void) { return p[unplugged] ? fail(COM) : p[opened] ? 0 : fail(NO_DEVICE); }
/* Faults of the function of this name. */
static int is_to_fail(const char *function) {
  if (strcmp(function, device->failing) || device->failures_left <= 0) return 0;
  device->failures_left--;
  return fail((int)device->failing_code);
}
static void delay(const char *function) {
  if (strcmp(function, device->late) || device->delays_left <= 0) return;
  device->delays_left--;
  come_late(1, 1, device->delay_s);
}
static int begin_of(const char *function) {
  start(), delay(function), lock(), catch_up();
  int code = is_to_fail(function);
  return code ? code : answer();
}
#define begin() begin_of(__func__)
static int end(int code) { unlock(); return code; }
#define PLAIN(...) do { int code = begin(); if (!code) { __VA_ARGS__; } return end(code); } while (0)

/* An accelerometer at the handle: newest_sample.py says what stands in its rows. Its clock is `time.monotonic`. */
static double *samples;
static unsigned long long drawn = 88172645463325252ULL;
static double evenly(void) { /* -0.5 to 0.5; Marsaglia, Xorshift RNGs, 2003 */
  drawn ^= drawn << 13, drawn ^= drawn >> 7, drawn ^= drawn << 17;
  return (double)drawn / 18446744073709551616.0 - 0.5;
}
static void sample(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  double *row = samples + 5 * (1 + (long)samples[0] % 16);
  row[0] = (double)t.tv_sec + 1e-9 * (double)t.tv_nsec, row[4] = 0;
  for (int i = 0; i < 3; i++) {
    double sum = 0;
    for (int k = 0; k < 12; k++) sum += evenly();
    row[1 + i] = p[ax + i] + p[noise] * sum;
  }
  samples[0]++;
}

/* For tests. */
EXPORT void stub_sensor(double *rows, int seed) { lock(), samples = rows, drawn = 88172645463325252ULL + (unsigned)seed, unlock(); }
EXPORT void stub_set(const char *name, double value) {
  lock(), start();
  int i = find(name, strlen(name));
  if (i >= 0) p[i] = value;
  if (i == frozen) memcpy(shown, x, sizeof x);
  unlock();
}
/* The next calls of a function of the vendor's, so many, answer -1 with this error; so many of its calls take so long. */
EXPORT void stub_fail(const char *function, double code, double times) {
  lock(), start();
  strncpy(device->failing, function, sizeof device->failing - 1);
  device->failing_code = code, device->failures_left = times;
  unlock();
}
EXPORT void stub_delay(const char *function, double seconds, double times) {
  lock(), start();
  strncpy(device->late, function, sizeof device->late - 1);
  device->delay_s = seconds, device->delays_left = times;
  unlock();
}
EXPORT double stub_get(const char *name) {
  lock(), catch_up();
  int i = find(name, strlen(name));
  double value = i < 0 ? NAN : p[i];
  unlock();
  return value;
}
/* Without a step of time: another program drives the device just now. */
EXPORT double stub_peek(const char *name) {
  start();
  int i = find(name, strlen(name));
  return i < 0 ? NAN : p[i];
}
EXPORT void stub_advance(double seconds) { lock(), start(), run_to(integrated_s + seconds), unlock(); }
EXPORT void stub_move(double to_x, double to_y, double to_z) { lock(), x[0] = to_x, x[1] = to_y, x[2] = to_z, unlock(); }

/* The vendor's names. */
EXPORT int dhdErrorGetLast(void) { return last_error; }
EXPORT const char *dhdErrorGetStr(int code) { return code < 0 || code > 22 ? "unknown" : texts[code]; }
EXPORT const char *dhdErrorGetLastStr(void) { return dhdErrorGetStr(last_error); }
EXPORT void dhdGetSDKVersion(int *major, int *minor, int *release, int *revision) {
  start();
  *major = 3, *minor = (int)p[sdk_minor], *release = 5, *revision = 0;
}
EXPORT int dhdGetDeviceCount(void) { start(); return p[unplugged] ? 0 : (int)p[devices]; }
EXPORT int dhdGetAvailableCount(void) { return p[in_use] ? 0 : dhdGetDeviceCount(); }
EXPORT int dhdOpenID(char id) {
  start(), delay(__func__), lock(), catch_up();
  int code = is_to_fail(__func__);
  if (code) return end(code);
  if (p[unplugged] || id >= p[devices]) code = fail(NO_DEVICE);
  else if (p[in_use]) code = fail(IN_USE);
  else if (p[open_fails]) code = fail((int)p[open_fails]);
  else p[opened] = 1, device->used = 0;
  return end(code ? code : id);
}
EXPORT int dhdClose(char id) { (void)id; PLAIN(p[opened] = 0; p[closes]++; drop(4)); }
EXPORT int dhdStop(char id) {
  (void)id;
  PLAIN(if (p[stop_fails] > 0) { p[stop_fails]--; code = fail(COM); } else if (!p[stop_ignored]) {
    memset(command, 0, sizeof command), p[stops]++, drop(4); });
}
EXPORT int dhdGetSystemType(char id) { (void)id; int code = begin(); return end(code ? code : (int)p[type]); }
EXPORT const char *dhdGetSystemName(char id) { (void)id; return p[type] == 33 ? "omega.3" : "another device"; }
EXPORT int dhdGetSerialNumber(unsigned short *serial, char id) { (void)id; PLAIN(if (p[serial_told]) *serial = (unsigned short)p[serial_no]); }
EXPORT int dhdGetVersion(double *version, char id) { (void)id; PLAIN(*version = p[firmware]); }
EXPORT int dhdGetStatus(int *status, char id) {
  (void)id;
  if (p[untold] == 1) PLAIN((void)0);
  PLAIN(memset(status, 0, 17 * sizeof(int)); status[0] = p[powered] != 0; status[1] = status[2] = 1;
        status[3] = p[calibrated] != 0; status[4] = !p[force_on] && !p[brake]; status[5] = p[force_on] != 0;
        status[6] = p[brake] != 0 || p[brakes_told] != 0; status[10] = p[gravity] != 0; status[11] = p[guard] != 0;
        status[14] = (int)p[cause]; come_late(1, p[status_late_s] > 0, p[status_late_s]));
}
EXPORT int dhdEnableForce(unsigned char value, char id) {
  (void)id;
  PLAIN(p[enables]++; memset(command, 0, sizeof command); if (!value) drop(4); else if (p[powered] && p[force_enables]) {
    p[force_on] = 1; p[brake] = 0; p[cause] = 0; last_command_s = p[now]; });
}
EXPORT int dhdSetBrakes(int value, char id) {
  (void)id;
  PLAIN(if (value && !p[brake]) p[braked_s] = p[now]; p[brake] = value != 0; if (value) memset(command, 0, sizeof command));
}
EXPORT int dhdGetPosition(double *px, double *py, double *pz, char id) {
  (void)id;
  int code = begin();
  double count = ++p[reads];
  if (samples) sample();
  if (!code && p[read_fails]) code = fail((int)p[read_fails]);
  if (!code) {
    int stale = p[stale_every] > 0 && fmod(count, p[stale_every]) == 0;
    for (int i = 0; i < 3; i++)
      if (!stale && !p[frozen] && p[frozen_axis] != i + 1) shown[i] = x[i];
    double said[3] = {shown[0] + (is_due(count, p[jump_every]) ? p[jump_m] : 0), shown[1], shown[2]};
    if (p[no_number]) said[((int)p[no_number] - 1) % 3] = p[no_number] > 6 ? -1e300 : p[no_number] > 3 ? INFINITY : NAN;
    if (!p[unwritten]) *px = said[0], *py = said[1], *pz = said[2];
    code = stale ? 1 : 0;
  }
  end(code);
  come_late(count, p[late_every], p[late_s]);
  return code;
}
EXPORT int dhdGetLinearVelocity(double *vx, double *vy, double *vz, char id) {
  (void)id;
  double k = p[told_speed], off = p[told_bias];
  PLAIN(*vx = k * v[0] + off; *vy = k * v[1] + off; *vz = k * v[2] + off);
}
EXPORT int dhdSetForce(double x_n, double y_n, double z_n, char id) {
  (void)id;
  int code = begin();
  if (!code && p[write_fails]) code = fail((int)p[write_fails]);
  if (!code) {
    double asked = sqrt(x_n * x_n + y_n * y_n + z_n * z_n), most = p[max_n];
    if (is_due(p[writes], p[scaled_every])) most = fmin(most, p[scaled_from_n]);
    if (p[cap_n] >= 0 && p[cap_works]) most = fmin(most, p[cap_n]);
    double share = asked > most * (1 + 1e-9) ? most / asked : 1;
    code = share < 1 ? 2 : 0;
    if (asked * share > p[silently_n]) share = p[silently_n] / asked;
    if (p[turned]) share = -share;
    share *= p[silent_gain];
    if (asked > 0 || !p[keeps_force]) command[0] = share * x_n, command[1] = share * y_n, command[2] = share * z_n;
    if (asked == 0 && p[last_write] > 0) p[zeroed_s] = p[now];
    p[writes]++, p[last_write] = asked, last_command_s = p[now];
    if (asked > 0) device->used = 1;
    if (!p[latches] && !p[force_on] && p[cause] == 3) p[force_on] = 1, p[brake] = 0, p[cause] = 0;
    if (!p[wall_time]) run_to(integrated_s + 0.001);
  }
  double count = p[writes];
  end(code);
  come_late(count, p[write_late_every], p[write_late_s]);
  return code;
}
EXPORT int dhdGetForce(double *x_n, double *y_n, double *z_n, char id) {
  (void)id;
  double *told[3] = {x_n, y_n, z_n}, step = p[told_step];
  if (p[untold] > 1) PLAIN((void)0);
  PLAIN(if (p[told_nan] > 0) { p[told_nan]--; *x_n = *y_n = *z_n = NAN; } else for (int i = 0; i < 3; i++) {
    double said = p[gain_told] * p[fx + i] + (i == 2 ? p[told_lift] : 0) + p[told_noise] * 3.4641016 * evenly();
    *told[i] = step > 0 ? step * round(said / step) : said;
  });
}
EXPORT double dhdGetComFreq(char id) { (void)id; return 1.0; }
EXPORT unsigned int dhdGetButtonMask(char id) {
  (void)id;
  int code = begin();
  return code ? (unsigned int)end(code) : (unsigned int)end((int)p[buttons]);
}
EXPORT int dhdSetGravityCompensation(int value, char id) { (void)id; PLAIN(p[gravity] = value); }
EXPORT int dhdSetEffectorMass(double kg, char id) { (void)id; PLAIN(p[effector] = kg); }
EXPORT int dhdGetEffectorMass(double *kg, char id) { (void)id; PLAIN(*kg = p[effector]); }
EXPORT int dhdSetMaxForce(double newtons, char id) { (void)id; PLAIN(p[cap_n] = newtons); }
EXPORT double dhdGetMaxForce(char id) { (void)id; return p[cap_n]; }
EXPORT int dhdConfigLinearVelocity(int ms, int mode, char id) { (void)ms, (void)mode, (void)id; PLAIN((void)0); }
EXPORT int dhdReset(char id) { (void)id; PLAIN(p[calibrated] = 0; p[resetting] = 1; reset_s = wall_s()); }
EXPORT int dhdWaitForReset(int ms, char id) {
  (void)id;
  double until_s = wall_s() + 1e-3 * ms;
  while (wall_s() < until_s)
    if (p[resetting] && wall_s() - reset_s > p[reset_after_s]) PLAIN(p[calibrated] = 1; p[resetting] = 0);
  return fail(TIMEOUT);
}
EXPORT int dhdEnableExpertMode(void) { p[expert] = 1; return 0; }
EXPORT int dhdDisableExpertMode(void) { p[expert] = 0; return 0; }
EXPORT int dhdSetTimeGuard(int us, char id) { (void)id; PLAIN(if (!p[expert]) code = fail(EXPERT_OFF); else p[guard] = us); }
EXPORT int dhdSetWatchdog(unsigned char units, char id) {
  (void)id;
  PLAIN(if (!p[expert]) code = fail(EXPERT_OFF); else if (!p[watchdog_settable]) code = fail(NOT_IMPLEMENTED);
        else { p[watchdog] = units; last_command_s = p[now]; });
}
EXPORT int dhdGetWatchdog(unsigned char *units, char id) { (void)id; PLAIN(*units = (unsigned char)p[watchdog]); }

#include "dhd_linkage.h"
