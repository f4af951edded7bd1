/* The least values of a dual bound's terms of position: see optimizer/bounds/least_potential.py. */

/* Ψ (B, S) of LeastPotential; joints `at` (nq): the two of the grid, then the others. */
void least_potential(long B, long S, long nq, long n, long m, const long *at, const double *first_axis,
                     const double *other_axis, const double *half, const double *gravity, const double *kinetic,
                     const double *slope, const double *deviation, const double *steepness, const double *gravity_along,
                     const double *gravity_across, const double *kinetic_along, const double *kinetic_across,
                     const double *gravity_others, const double *kinetic_others, double scale, const double *cross,
                     const double *hold, const double *weight, const double *fast, const double *slow,
                     const double *excess, double *result) {
  const long K = n * m, cells = (n - 1) * (m - 1), others = nq - 2;
  /* an arm of two joints has no others */
  double corner[K], moved[cells], stiffness[others + 1], more[others + 1];
  for (long s = 0; s < S; ++s) {
    const double *own_slope = slope + nq * s, *own_half = half + nq * s;
    for (long b = 0; b < B; ++b) result[S * b + s] = 0.0;
    for (long side = 0; side < 2; ++side) {
      const long end = 2 * s + side;
      for (long c = 0; c < cells; ++c) {
        const double *each = deviation + nq * (cells * end + c);
        moved[c] = 0.0;
        for (long j = 0; j < nq; ++j) moved[c] += weight[j] * each[j] * each[j];
      }
      for (long b = 0; b < B; ++b) {
        const double f2 = fast[b] * fast[b], s2 = slow[b] * slow[b];
        for (long i = 0; i < n; ++i)
          for (long k = 0; k < m; ++k) {
            const long point = m * i + k;
            const double u = first_axis[i], v = other_axis[k];
            const double along = own_slope[at[0]] * u + own_slope[at[1]] * v;
            const double square = (hold[at[0]] * u * u + hold[at[1]] * v * v) / 2 - scale * kinetic[K * end + point];
            corner[point] = scale * (gravity[K * end + point] - along - greater(excess[b] * along, 0.0)) +
                            lesser(f2 * square, s2 * square);
          }
        double bend[2];
        for (long i = 0; i < 2; ++i)
          bend[i] = (scale * (gravity_across[2 * s + i] + f2 * kinetic_across[2 * s + i]) + f2 * hold[at[i]]) / 8;
        for (long i = 0; i < others; ++i) {
          const long joint = at[2 + i], o = others * s + i;
          stiffness[i] = hold[joint] * s2 - scale * gravity_others[o] - f2 * cross[o];
          more[i] = excess[b] * fabs(own_slope[joint]) + f2 * kinetic_others[o];
        }
        const double flat = scale * (gravity_along[s] + f2 * kinetic_along[s]);
        double least = INFINITY;
        for (long i = 0; i < n - 1; ++i) {
          if (lesser(fabs(first_axis[i]), fabs(first_axis[i + 1])) > own_half[at[0]]) continue;
          const double h = first_axis[i + 1] - first_axis[i];
          for (long k = 0; k < m - 1; ++k) {
            if (lesser(fabs(other_axis[k]), fabs(other_axis[k + 1])) > own_half[at[1]]) continue;
            const double l = other_axis[k + 1] - other_axis[k], *low = corner + m * i + k;
            const long c = (m - 1) * i + k;
            double value = lesser(lesser(low[0], low[1]), lesser(low[m], low[m + 1]));
            value -= bend[0] * h * h + bend[1] * l * l + flat + f2 * moved[c];
            if (value >= INFINITY) continue;
            const double *steep = steepness + others * (cells * end + c);
            for (long o = 0; o < others; ++o) {
              const double rise = scale * (steep[o] + more[o]), side_length = own_half[at[2 + o]];
              const double far = stiffness[o] > 0 ? lesser(rise / stiffness[o], side_length) : side_length;
              value -= rise * far - stiffness[o] * far * far / 2;
            }
            least = lesser(least, value);
          }
        }
        result[S * b + s] += least / 2;
      }
    }
  }
}
