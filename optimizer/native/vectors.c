/* What the other files share: numbers, and vectors of three. */

#include <math.h>

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double *a, const double *b, double *y) {
  y[0] = a[1] * b[2] - a[2] * b[1];
  y[1] = a[2] * b[0] - a[0] * b[2];
  y[2] = a[0] * b[1] - a[1] * b[0];
}

static double lesser(double a, double b) { return a < b ? a : b; }

static double greater(double a, double b) { return a > b ? a : b; }

static double clipped(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

/* a vector by the rotation of the pose T (4, 4) */
static void turn(const double *T, const double *x, double *y) {
  for (int i = 0; i < 3; ++i) y[i] = dot(T + 4 * i, x);
}

static void turn_back(const double *T, const double *x, double *y) {
  for (int i = 0; i < 3; ++i) y[i] = T[i] * x[0] + T[4 + i] * x[1] + T[8 + i] * x[2];
}

/* a point by the pose T */
static void place(const double *T, const double *x, double *y) {
  turn(T, x, y);
  for (int i = 0; i < 3; ++i) y[i] += T[4 * i + 3];
}

/* a point in the frame of the pose T */
static void into(const double *T, const double *x, double *y) {
  double d[3];
  for (int i = 0; i < 3; ++i) d[i] = x[i] - T[4 * i + 3];
  turn_back(T, d, y);
}
