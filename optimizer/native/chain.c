/* Forward kinematics of many configurations: what optimizer/kinematics/forward.py computes by numpy. */

#include <math.h>

/* Frames (n, nq + 1, 4, 4) for q (n, nq) [rad] of revolute joints about z at placements (nq, 4, 4). */
void link_frames(long n, long nq, const double *placements, const double *q, double *frames) {
  for (long k = 0; k < n; ++k) {
    double *T = frames + 16 * (nq + 1) * k;
    for (int i = 0; i < 16; ++i) T[i] = i % 5 == 0;
    for (long j = 0; j < nq; ++j, T += 16) {
      const double *P = placements + 16 * j, c = cos(q[nq * k + j]), s = sin(q[nq * k + j]);
      double step[12], *next = T + 16;
      for (int i = 0; i < 3; ++i) {
        const double x = P[4 * i], y = P[4 * i + 1];
        step[4 * i] = c * x + s * y;
        step[4 * i + 1] = c * y - s * x;
        step[4 * i + 2] = P[4 * i + 2];
        step[4 * i + 3] = P[4 * i + 3];
      }
      for (int i = 0; i < 3; ++i) {
        for (int m = 0; m < 4; ++m)
          next[4 * i + m] = T[4 * i] * step[m] + T[4 * i + 1] * step[4 + m] + T[4 * i + 2] * step[8 + m];
        next[4 * i + 3] += T[4 * i + 3];
      }
      next[12] = next[13] = next[14] = 0.0;
      next[15] = 1.0;
    }
  }
}
