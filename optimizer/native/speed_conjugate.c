/* The greatest values of a dual bound's terms of speed: see optimizer/bounds/speed_conjugate.py. */

/* A concave friction torque by intervals: the fields of FrictionConjugate, (nq, intervals), and `load` or NULL. */
typedef struct {
  long intervals, nq;
  const double *first, *last, *constant, *slope, *sagitta, *load;
} Friction;

/* with wider registers where the processor has them; glibc chooses. The clang of ziglang cannot link it */
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

/* An upper bound on max over |v| ≤ most of p v - (v + omega) tau_f(v) + square v² for one joint, and where it is, with
   1 / (2 (slope - square)) by interval, 0 if not bent.

   For v ≥ 0 the torque is between its chord and the chord plus the sagitta. So (v + omega) tau_f(v) ≥ (v + omega) chord -
   max(-(first + omega), 0) sagitta, a quadratic function of v, whose greatest value on an interval is known. For v < 0
   the same holds with -v, -p, -omega, as the torque is odd. Against p a value is at most that of p v + square v² at an
   end, or zero, and what friction helps omega by at the greatest torque: where that is no more than the value along p,
   it is left out.

   Where friction grows with the load, ω̂ stands in the place of omega: that of all from omega / (1 + load) to omega / (1 -
   load) at which ω̂ tau_f(v) is least. */
WIDE static double greatest(const Friction *of, long joint, double p, double omega, double square, const double *inverse,
                       double most, double *where) {
  const long I = of->intervals;
  const double *first = of->first + I * joint, *last = of->last + I * joint, *constant = of->constant + I * joint;
  const double *slope = of->slope + I * joint, *sagitta = of->sagitta + I * joint;
  const double load = of->load ? of->load[joint] : 0.0;
  const double torque = constant[I - 1] + slope[I - 1] * last[I - 1];
  double value[I], at[I], best = 0.0;
  long count = 0;
  while (count < I && first[count] <= most) ++count;
  *where = 0.0;
  for (int way = 0; way < 2; ++way) {
    const double sign = (p < 0) == (way == 0) ? -1.0 : 1.0;
    const double shift = sign * omega / (sign * omega > 0 ? 1 + load : 1 - load);
    /* against p there is mostly nothing to be gained */
    if (way && greater((sign * p + greater(square, 0.0) * most) * most, 0.0) + greater(-shift, 0.0) * torque <= best) break;
    /* without a branch, so that several intervals go at once */
    for (long k = 0; k < count; ++k) {
      const double low = first[k], high = lesser(last[k], most), second = square - slope[k];
      const double rate = sign * p - constant[k] - shift * slope[k], peak = clipped(rate * inverse[k], low, high);
      const double v = inverse[k] > 0 ? peak : high;
      const double top = greater((second * v + rate) * v, (second * low + rate) * low);
      value[k] = top - shift * constant[k] + greater(-(low + shift), 0.0) * sagitta[k];
      at[k] = v;
    }
    for (long k = 0; k < count; ++k)
      if (value[k] > best) {
        best = value[k];
        *where = sign * at[k];
      }
  }
  return best;
}

/* A path of S steps, with multipliers as they are; `costate` (S + 1, nq) is Γ / T. */
typedef struct {
  long S;
  const double *spread, *costate, *momentum, *x_rate, *omega;
} Path;

/* Parts (P) of steps as of TimeParts, and the means of their speeds by step (2, S, nq) for the first and last duration. */
typedef struct {
  long P;
  const long *step;
  const double *within, *length, *speed, *mean;
} Parts;

/* Weights, and what follows from them for a path: κ + μ + ν (S, nq), and 1 / (2 (slope - square)) of `greatest` (S, nq,
   intervals). */
typedef struct {
  double scale, work;
  const double *slowness;
  double *stiffness, *inverse;
} Weighted;

static void weigh(const Path *path, const Friction *friction, const double *stiffness, Weighted *by) {
  const long nq = friction->nq, I = friction->intervals;
  for (long s = 0; s < path->S; ++s)
    for (long j = 0; j < nq; ++j) {
      const long at = nq * s + j;
      by->stiffness[at] = stiffness[j] + by->scale * path->spread[at];
      const double square = (by->stiffness[at] / 2 + by->work * by->slowness[j]) / (1 + 2 * by->work);
      for (long k = 0; k < I; ++k) {
        const double bend = friction->slope[I * j + k] - square;
        by->inverse[I * at + k] = bend > 0 ? 1 / (2 * bend) : 0.0;
      }
    }
}

/* H of joint j in a step for one p, and the speed where it is. */
static double height(const Weighted *by, const Friction *friction, long s, long j, double p, double omega, double b,
                     double most, double *where) {
  const long at = friction->nq * s + j;
  const double more = 1 + 2 * by->work, stiffness = by->stiffness[at], slowness = by->slowness[j];
  const double linear = p - stiffness * b + slowness * omega, square = (stiffness / 2 + by->work * slowness) / more;
  const double *inverse = by->inverse + friction->intervals * at;
  const double value = greatest(friction, j, linear / more, omega / more, square, inverse, most, where);
  return more * value - p * b + stiffness * b * b / 2;
}

/* m (nq) for one duration, with the greatest speeds (S, nq) in the mean of each step. */
static void multiplier(const Weighted *by, const Path *path, const Friction *friction, long bisections, double duration,
                       const double *most, double *m) {
  const long S = path->S, nq = friction->nq, I = friction->intervals;
  double p[S];
  for (long j = 0; j < nq; ++j) {
    const long last = I * (j + 1) - 1;
    const double fastest = friction->last[last];
    double greatest_p = 0.0, stiffest = 0.0, displacement = 0.0;
    for (long s = 0; s < S; ++s) {
      const long at = nq * s + j;
      p[s] = by->scale *
             (duration * (path->costate[at] + path->costate[at + nq]) / 2 + path->momentum[at] / duration);
      greatest_p = greater(greatest_p, fabs(p[s]));
      stiffest = greater(stiffest, by->stiffness[at]);
      displacement += path->x_rate[at];
    }
    const double torque = friction->constant[last] + friction->slope[last] * fastest;
    double high = 4 * torque + greatest_p + stiffest * fastest, low = -high;
    for (long round = 0; round < bisections; ++round) {
      double travel = 0.0, v;
      m[j] = (low + high) / 2;
      for (long s = 0; s < S; ++s) {
        const long at = nq * s + j;
        const double omega = by->scale * (path->omega[at] + path->omega[at + nq]) / 2;
        height(by, friction, s, j, p[s] + m[j], omega, path->x_rate[at] / duration, most[at], &v);
        travel += v;
      }
      if (duration * travel < displacement) low = m[j];
      else high = m[j];
    }
    m[j] = (low + high) / 2;
  }
}

/* Integrals (E) and ∫ p · x' ds (E) of SpeedConjugate for durations (E), and `stiffness` (nq) κ + μ. */
void speed_conjugate(const Friction *friction, const Path *path, const Parts *parts, double scale, double work,
                     long bisections, long E, const double *stiffness, const double *slowness, const double *duration,
                     double *integral, double *along) {
  const long nq = friction->nq, S = path->S;
  double stiff[S * nq], inverse[S * nq * friction->intervals], ends[2][nq], v;
  Weighted by = {scale, work, slowness, stiff, inverse};
  weigh(path, friction, stiffness, &by);
  for (long last = 0; last < 2; ++last)
    multiplier(&by, path, friction, bisections, duration[last * (E - 1)], parts->mean + last * S * nq, ends[last]);
  const double range = greater(1 / duration[0] - 1 / duration[E - 1], 1e-300);
  for (long e = 0; e < E; ++e) {
    const double T = duration[e], share = (1 / T - 1 / duration[E - 1]) / range;
    integral[e] = along[e] = 0.0;
    for (long part = 0; part < parts->P; ++part)
      for (long j = 0; j < nq; ++j) {
        const long at = nq * parts->step[part] + j;
        const double m = ends[1][j] + share * (ends[0][j] - ends[1][j]) + scale * path->momentum[at] / T;
        const double most = parts->speed[nq * (parts->P * e + part) + j];
        for (long end = 0; end < 2; ++end) {
          const double to = parts->within[2 * part + end], from = 1 - to;
          const double p = scale * T * (from * path->costate[at] + to * path->costate[at + nq]) + m;
          const double omega = scale * (from * path->omega[at] + to * path->omega[at + nq]);
          const double H = height(&by, friction, parts->step[part], j, p, omega, path->x_rate[at] / T, most, &v);
          integral[e] += parts->length[part] / 2 * H;
          along[e] += parts->length[part] / 2 * p * path->x_rate[at];
        }
      }
  }
}
