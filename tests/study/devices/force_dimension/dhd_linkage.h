/* The linkage behind the stub of the vendor's library: a delta of its own numbers, solved by brute force. Elbows at an
 * arm's length from the base's rim, forearms of a fixed length; angles and positions by Newton's steps, every derivative
 * by differences. No formula is shared with what is fitted to it. Included at the end of dhd_stub.c, whose
 * one-letter names are macros. */
#define ARM (1.02 * 0.098)
#define FOREARM 0.171
#define RIM 0.058
#define DEPTH 0.158 /* of the origin in front of the base */
#define HANDLE_KG 0.21
#define TURNING_KG_M2 0.0013
#define ARM_WEIGHT_N_M 0.02 /* at a level arm: what its counterweight leaves */
#define COUNTS_PER_TURN 64000.0
#define TURN 6.283185307179586

static double arm_azimuth(int k) { return (p[linkage_turned_deg] / 360 + 0.25 + k / 3.0) * TURN; }

/* How far handle and elbow are from a forearm's length, for an arm turned by q out of the base's plane. */
static double gap(int k, double q, const double at[3]) {
  double radial = RIM + ARM * cos(q), azimuth = arm_azimuth(k);
  double dx = at[0] + DEPTH - ARM * sin(q), dy = at[1] - radial * cos(azimuth), dz = at[2] - radial * sin(azimuth);
  return sqrt(dx * dx + dy * dy + dz * dz) - FOREARM;
}

/* The elbow that lies outwards: from arms towards the base on, the first angle that closes the gap. NAN: none does. */
static double joint(int k, const double at[3]) {
  double before = -1.2, step = 0.1;
  while (before < 1.5 && gap(k, before, at) * gap(k, before + step, at) > 0) before += step;
  if (before >= 1.5) return NAN;
  double q = before + 0.5 * step, h = 1e-6;
  for (int i = 0; i < 8; i++) {
    double left = gap(k, q, at), slope = (gap(k, q + h, at) - gap(k, q - h, at)) / (2 * h);
    q -= left / slope;
    if (fabs(left) < 1e-16) break;
  }
  return q > before - step && q < before + 2 * step ? q : NAN;
}

/* jcb = d position / d joint: the inverse of d joint / d position, itself by differences. 0: singular or no number. */
static int by_differences(const double at[3], double jcb[3][3]) {
  double rates[3][3], h = 1e-5;
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 3; i++) {
      double before[3] = {at[0], at[1], at[2]}, after[3] = {at[0], at[1], at[2]};
      before[i] -= h, after[i] += h;
      rates[k][i] = (joint(k, after) - joint(k, before)) / (2 * h);
    }
  double determinant = 0;
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 3; i++) {
      int k1 = (k + 1) % 3, k2 = (k + 2) % 3, i1 = (i + 1) % 3, i2 = (i + 2) % 3;
      jcb[i][k] = rates[k1][i1] * rates[k2][i2] - rates[k1][i2] * rates[k2][i1];
      if (k == 0) determinant += rates[0][i] * jcb[i][0];
    }
  for (int i = 0; i < 9; i++) jcb[i / 3][i % 3] /= determinant;
  return isfinite(determinant) && determinant != 0;
}

/* From the last place on: the next is near. */
static int place(const double q[3], double at[3]) {
  static double last[3];
  memcpy(at, last, sizeof last);
  for (int n = 0; n < 60; n++) {
    double jcb[3][3];
    if (!by_differences(at, jcb)) return 0;
    double off[3];
    for (int k = 0; k < 3; k++) off[k] = q[k] - joint(k, at);
    for (int i = 0; i < 3; i++) at[i] += jcb[i][0] * off[0] + jcb[i][1] * off[1] + jcb[i][2] * off[2];
    if (fabs(off[0]) + fabs(off[1]) + fabs(off[2]) < 1e-11) {
      memcpy(last, at, sizeof last);
      return 1;
    }
  }
  memset(last, 0, sizeof last);
  return 0;
}

enum { GEOMETRY = 8 };
static int count_of(double q) { return (int)lround(q / TURN * COUNTS_PER_TURN); }
static double angle_of(int counts) { return counts / COUNTS_PER_TURN * TURN; }

EXPORT int dhdDeltaPositionToEncoder(double ax_m, double ay_m, double az_m, int *e0, int *e1, int *e2, char id) {
  (void)id;
  double at[3] = {ax_m, ay_m, az_m}, q[3];
  if (p[reach_z_m] > 0 && az_m > p[reach_z_m]) return fail(GEOMETRY);
  for (int k = 0; k < 3; k++)
    if (isnan(q[k] = joint(k, at))) return fail(GEOMETRY);
  *e0 = count_of(q[0]), *e1 = count_of(q[1]), *e2 = count_of(q[2]);
  return 0;
}
EXPORT int dhdDeltaEncodersToJointAngles(int e0, int e1, int e2, double *j0, double *j1, double *j2, char id) {
  (void)id;
  *j0 = angle_of(e0), *j1 = angle_of(e1), *j2 = angle_of(e2);
  return 0;
}
EXPORT int dhdDeltaEncoderToPosition(int e0, int e1, int e2, double *px, double *py, double *pz, char id) {
  (void)id;
  double q[3] = {angle_of(e0), angle_of(e1), angle_of(e2)}, at[3];
  if (!place(q, at)) return fail(GEOMETRY);
  *px = at[0], *py = at[1], *pz = at[2];
  return 0;
}
EXPORT int dhdGetJointAngles(double j[8], char id) {
  (void)id;
  double at[3] = {x[0] + p[frame_off_m], x[1], x[2]};
  for (int k = 0; k < 8; k++) j[k] = k < 3 ? joint(k, at) : 0;
  return answer();
}
EXPORT int dhdDeltaJointAnglesToJacobian(double j0, double j1, double j2, double jcb[3][3], char id) {
  (void)id;
  double q[3] = {j0, j1, j2}, at[3];
  if (!place(q, at) || !by_differences(at, jcb)) return fail(GEOMETRY);
  double told[3][3];
  memcpy(told, jcb, sizeof told);
  for (int i = 0; i < 9; i++) {
    if (p[bad_jacobian] == 1) jcb[i / 3][i % 3] = told[i % 3][i / 3]; /* rows and columns confused */
    if (p[bad_jacobian] == 2) jcb[i / 3][i % 3] = told[0][i % 3];     /* singular */
    if (p[bad_jacobian] == 3) jcb[i / 3][i % 3] = NAN;
  }
  return 0;
}
/* From the kinetic energy: the handle's, and each arm's, which turns at its own speed. */
EXPORT int dhdJointAnglesToInertiaMatrix(double j[8], double inertia[6][6], char id) {
  (void)id;
  double at[3], h = 1e-5, rate[3][3];
  if (!place(j, at)) return fail(GEOMETRY);
  for (int i = 0; i < 3; i++) {
    double before[3] = {at[0], at[1], at[2]}, after[3] = {at[0], at[1], at[2]};
    before[i] -= h, after[i] += h;
    for (int k = 0; k < 3; k++) rate[k][i] = (joint(k, after) - joint(k, before)) / (2 * h);
  }
  memset(inertia, 0, 36 * sizeof(double));
  for (int a = 0; a < 3; a++)
    for (int b = 0; b < 3; b++) {
      inertia[a][b] = a == b ? HANDLE_KG : 0;
      for (int k = 0; k < 3; k++)
        inertia[a][b] += TURNING_KG_M2 * (1 + (k == 1 ? p[odd_arm] : 0)) * rate[k][a] * rate[k][b];
    }
  if (p[bad_inertia] == 1) inertia[0][1] += 0.05;
  if (p[bad_inertia] == 2) inertia[2][2] = -inertia[2][2];
  if (p[bad_inertia] == 3) inertia[1][1] = NAN;
  return 0;
}
/* What holds the arms: the change of potential energy with each joint, the others at rest. */
EXPORT int dhdJointAnglesToGravityJointTorques(double j[8], double q[8], unsigned char mask, char id) {
  (void)id;
  for (int k = 0; k < 3; k++) {
    double moved[3] = {j[0], j[1], j[2]}, before[3], after[3], h = 1e-5;
    moved[k] -= h;
    if (!place(moved, before)) return fail(GEOMETRY);
    moved[k] += 2 * h;
    if (!place(moved, after)) return fail(GEOMETRY);
    double arm = ARM_WEIGHT_N_M * (cos(j[k] + h) - cos(j[k] - h)) * sin(arm_azimuth(k));
    if (mask & 1 << k) q[k] = (9.81 * HANDLE_KG * (after[2] - before[2]) + arm) / (2 * h);
  }
  return 0;
}
