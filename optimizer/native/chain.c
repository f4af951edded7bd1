/* Forward kinematics of many configurations: see optimizer/kinematics/forward.py. */

/* Frames (nq + 1, 4, 4) of revolute joints about z at placements (nq, 4, 4), turned by angles of these cosines and sines
   (nq). */
static void frames_of(long nq, const double *placements, const double *cosine, const double *sine, double *frames) {
  double *T = frames;
  for (int i = 0; i < 16; ++i) T[i] = i % 5 == 0;
  for (long j = 0; j < nq; ++j, T += 16) {
    const double *P = placements + 16 * j, c = cosine[j], s = sine[j];
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

/* Frames (n, nq + 1, 4, 4) for q (n, nq) [rad]. */
void link_frames(long n, long nq, const double *placements, const double *q, double *frames) {
  double cosine[nq], sine[nq];
  for (long k = 0; k < n; ++k) {
    for (long j = 0; j < nq; ++j) {
      cosine[j] = cos(q[nq * k + j]);
      sine[j] = sin(q[nq * k + j]);
    }
    frames_of(nq, placements, cosine, sine, frames + 16 * (nq + 1) * k);
  }
}
