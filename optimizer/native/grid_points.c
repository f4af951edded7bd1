/* Gravity and inertia around a path with multipliers: see optimizer/bounds/grid_points.py.

   Arrays of joints have nq rows; those of configurations, points or steps have them outside. */

/* A chain, with the fields of ChainDerivatives. */
typedef struct {
  long nq;
  const double *placements, *mass, *lever, *inertia, *rotor, *g;
} Chain;

/* Axis, origin, centre of mass, and the products of inertia about the base (xx, yy, zz, xy, xz, yz) of a link. */
typedef struct {
  double z[3], o[3], c[3], J[6];
} Link;

static void links_of(const Chain *chain, const double *cosine, const double *sine, Link *links) {
  static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  double frames[16 * (chain->nq + 1)], turned[9];
  frames_of(chain->nq, chain->placements, cosine, sine, frames);
  for (long j = 0; j < chain->nq; ++j) {
    const double *T = frames + 16 * (j + 1), *I = chain->inertia + 9 * j, m = chain->mass[j];
    Link *link = links + j;
    for (int i = 0; i < 3; ++i) {
      link->z[i] = T[4 * i + 2];
      link->o[i] = T[4 * i + 3];
      for (int k = 0; k < 3; ++k) turned[3 * i + k] = T[4 * i] * I[k] + T[4 * i + 1] * I[3 + k] + T[4 * i + 2] * I[6 + k];
    }
    place(T, chain->lever + 3 * j, link->c);
    const double *c = link->c, square = dot(c, c);
    for (int i = 0; i < 6; ++i)
      link->J[i] = dot(turned + 3 * row[i], T + 4 * column[i]) + m * ((i < 3 ? square : 0.0) - c[row[i]] * c[column[i]]);
  }
}

/* Torques (nq) [N·m] of gravity, and their derivatives (nq, nq). */
static void gravity_torque(const Chain *chain, const Link *links, double *torque, double *slope) {
  const long nq = chain->nq;
  double outer = 0.0, moment[3] = {0.0, 0.0, 0.0}, lever[nq][3], across[3], about[3];
  for (long j = nq - 1; j >= 0; --j) {
    const Link *link = links + j;
    outer += chain->mass[j];
    for (int i = 0; i < 3; ++i) {
      moment[i] += chain->mass[j] * link->c[i];
      about[i] = moment[i] - outer * link->o[i];
    }
    cross(link->z, about, lever[j]);
    torque[j] = -dot(lever[j], chain->g);
    cross(chain->g, link->z, across);
    for (long k = j; k < nq; ++k) slope[nq * j + k] = slope[nq * k + j] = -dot(across, lever[k]);
  }
}

/* Joint-space inertia (nq, nq) [kg·m²], by momenta of unit speeds about the base. */
static void joint_inertia(const Chain *chain, const Link *links, double *M) {
  const long nq = chain->nq;
  double outer = 0.0, moment[3] = {0.0, 0.0, 0.0}, J[6] = {0.0};
  double angular[nq][3], linear[nq][3], speed[3], by_moment[3];
  for (long j = nq - 1; j >= 0; --j) {
    const Link *link = links + j;
    const double *z = link->z;
    outer += chain->mass[j];
    for (int i = 0; i < 3; ++i) moment[i] += chain->mass[j] * link->c[i];
    for (int i = 0; i < 6; ++i) J[i] += link->J[i];
    cross(link->o, z, speed);
    cross(z, moment, by_moment);
    for (int i = 0; i < 3; ++i) linear[j][i] = outer * speed[i] + by_moment[i];
    cross(moment, speed, by_moment);
    angular[j][0] = J[0] * z[0] + J[3] * z[1] + J[4] * z[2] + by_moment[0];
    angular[j][1] = J[3] * z[0] + J[1] * z[1] + J[5] * z[2] + by_moment[1];
    angular[j][2] = J[4] * z[0] + J[5] * z[1] + J[2] * z[2] + by_moment[2];
    for (long k = j; k < nq; ++k)
      M[nq * j + k] = M[nq * k + j] = dot(z, angular[k]) + dot(speed, linear[k]) + (j == k ? chain->rotor[j] : 0.0);
  }
}

/* The inertia (n, nq, nq) at n configurations (n, nq) [rad]. */
void joint_inertias(const Chain *chain, long n, const double *q, double *M) {
  const long nq = chain->nq;
  double cosine[nq], sine[nq];
  Link links[nq];
  for (long k = 0; k < n; ++k) {
    for (long j = 0; j < nq; ++j) {
      cosine[j] = cos(q[nq * k + j]);
      sine[j] = sin(q[nq * k + j]);
    }
    links_of(chain, cosine, sine, links);
    joint_inertia(chain, links, M + nq * nq * k);
  }
}

static void times(long nq, const double *A, const double *x, double *y) {
  for (long j = 0; j < nq; ++j) {
    y[j] = 0.0;
    for (long k = 0; k < nq; ++k) y[j] += A[nq * j + k] * x[k];
  }
}

static double product(long nq, const double *a, const double *b) {
  double sum = 0.0;
  for (long j = 0; j < nq; ++j) sum += a[j] * b[j];
  return sum;
}

/* The fields of GridPoints for a path x (S + 1, nq) with multipliers (S + 1, nq), at offsets (K, nq) where `needed` (S +
   1, K); those of other points stay as they are. */
void grid_points(const Chain *chain, long S, long K, double step, const double *x, const double *omega,
                 const double *offsets, const char *needed, double *gravity, double *slope, double *kinetic,
                 double *momentum, double *rows) {
  const long nq = chain->nq;
  Link links[nq];
  double cosine[nq], sine[nq], cos_x[nq], sin_x[nq], cos_step[nq], sin_step[nq], torque[nq], U2[nq * nq];
  double M[nq * nq], N[nq * nq], own_slope[nq], x_rate[nq], omega_rate[nq], Mw[nq], Nx[nq];
  for (long j = 0; j < (S + 1) * nq; ++j) rows[j] = 0.0;
  for (long n = 0; n <= S; ++n) {
    const double *w = omega + nq * n;
    for (long j = 0; j < nq; ++j) {
      cos_x[j] = cos(x[nq * n + j]);
      sin_x[j] = sin(x[nq * n + j]);
      cos_step[j] = cos(step * w[j]);
      sin_step[j] = sin(step * w[j]);
    }
    for (long k = 0; k < K; ++k) {
      if (!needed[K * n + k]) continue;
      for (long j = 0; j < nq; ++j) {
        const double off = offsets[nq * k + j], q = x[nq * n + j] + off;
        cosine[j] = off == 0.0 ? cos_x[j] : cos(q);
        sine[j] = off == 0.0 ? sin_x[j] : sin(q);
      }
      links_of(chain, cosine, sine, links);
      gravity_torque(chain, links, torque, U2);
      joint_inertia(chain, links, M);
      for (long j = 0; j < nq; ++j) {
        const double c = cosine[j];
        cosine[j] = c * cos_step[j] - sine[j] * sin_step[j];
        sine[j] = sine[j] * cos_step[j] + c * sin_step[j];
      }
      links_of(chain, cosine, sine, links);
      joint_inertia(chain, links, N);
      for (long j = 0; j < nq * nq; ++j) N[j] = (N[j] - M[j]) / step;
      for (long j = 0; j < nq; ++j) {
        double row = greater(N[(nq + 1) * j], 0.0);
        for (long i = 0; i < nq; ++i) row += i == j ? 0.0 : fabs(N[nq * j + i]);
        rows[nq * n + j] = greater(rows[nq * n + j], row);
      }
      times(nq, U2, w, own_slope);
      for (long side = 0; side < 2; ++side) {
        /* the node is the beginning of step n, and the end of the one before */
        const long s = n - side;
        if (s < 0 || s >= S) continue;
        for (long j = 0; j < nq; ++j) {
          x_rate[j] = (x[nq * (s + 1) + j] - x[nq * s + j]) * S;
          omega_rate[j] = (omega[nq * (s + 1) + j] - omega[nq * s + j]) * S;
        }
        const long point = (2 * s + side) * K + k;
        times(nq, M, omega_rate, Mw);
        times(nq, N, x_rate, Nx);
        gravity[point] = product(nq, w, torque);
        kinetic[point] = product(nq, x_rate, Mw) + product(nq, x_rate, Nx) / 2;
        for (long j = 0; j < nq; ++j) {
          slope[nq * point + j] = own_slope[j];
          momentum[nq * point + j] = Mw[j] + Nx[j];
        }
      }
    }
  }
}

/* GridCells.deviation: in each cell (S, 2, cells, count) of a grid over two axes (n, m), how far values (S, 2, n m, nq) of
   some joints (count) may be from their means (S, nq), with the curvature `along` (S, nq) and `across` (S, 2, nq). */
void cell_deviation(long S, long nq, long n, long m, long count, const double *first_axis, const double *other_axis,
                    const long *joints, const double *value, const double *mean, const double *along,
                    const double *across, double *result) {
  double away[n * m];
  for (long end = 0; end < 2 * S; ++end)
    for (long i = 0; i < count; ++i) {
      const long s = end / 2, j = joints[i];
      const double own = mean[nq * s + j], flat = along[nq * s + j];
      const double bend = across[nq * 2 * s + j] / 8, other_bend = across[nq * (2 * s + 1) + j] / 8;
      for (long p = 0; p < n * m; ++p) away[p] = fabs(value[nq * (n * m * end + p) + j] - own);
      for (long a = 0; a < n - 1; ++a) {
        const double h = first_axis[a + 1] - first_axis[a];
        for (long b = 0; b < m - 1; ++b) {
          const double l = other_axis[b + 1] - other_axis[b], *low = away + m * a + b;
          const double corners = greater(greater(low[0], low[1]), greater(low[m], low[m + 1]));
          result[count * ((n - 1) * (m - 1) * end + (m - 1) * a + b) + i] = corners + flat + bend * h * h + other_bend * l * l;
        }
      }
    }
}
