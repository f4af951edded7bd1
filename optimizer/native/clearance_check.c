/* Whether pairs of bodies are far enough apart at configurations along a line, without their distances. */

/* Pairs (p) that may be no nearer than `reserve`, and room for their check: see ClearanceCheck in
   compiled_distances.py, which has the same order. */
typedef struct {
  const Shapes *shapes;
  const double *placements;
  long p, rows;
  const long *pairs, *ends;  /* the bodies (p, 2) of the pairs */
  const double *reach;       /* (p) [m]: the distance of ball centres from which on a pair is far enough apart */
  const double *levers;      /* (rows, n) [m/rad]: how fast distances change at most with the joints */
  const long *lever_of;      /* the row (p) of each pair */
  double reserve;
  double *frames;            /* (n + 1, 4, 4) at the last configuration */
  double *directions;        /* (p, 3), where searches of `convex_convex` begin */
  double *centre, *changes;  /* (bodies, 3) and (rows) */
  long *open, *last;         /* pairs (p) to be checked, and one that was near, which is checked first */
} Check;

/* Whether a pair is nearer than the reserve. Begun along the last direction, most searches of `convex_convex` prove at
   their first step that the cores are apart. */
static int is_near(const Check *check, long k) {
  const Shapes *shapes = check->shapes;
  const long pair = check->pairs[k];
  const double least = check->reserve + shapes->growth[pair];
  double normal[3], point[3], *direction = check->directions + 3 * k;
  if (bead_bound(shapes, check->frames, 0, pair) >= least) return 0;
  /* NAN for cores that touch or overlap */
  return !(pair_distance(shapes, check->frames, 0, pair, least, least, direction, normal, point) >= least);
}

/* Whether the open pairs are far enough apart at q (n) [rad]. In the `middle` of a line, closes those whose distances
   stay beyond the reserve if they change by no more than `changes`; from elsewhere, the rest of the line may be longer
   than the half for which `changes` hold. */
static int is_clear(const Check *check, const double *q, int middle, long *count) {
  const Shapes *shapes = check->shapes;
  link_frames(1, shapes->frames - 1, check->placements, q, check->frames);
  for (long b = 0; b < shapes->bodies; ++b)
    place(frame_of(shapes, check->frames, 0, b), shapes->ball_centres + 3 * b, check->centre + 3 * b);
  long left = 0;
  for (long j = 0; j < *count; ++j) {
    const long k = check->open[j];
    const double *a = check->centre + 3 * check->ends[2 * k], *b = check->centre + 3 * check->ends[2 * k + 1];
    const double across[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double squared = dot(across, across), near = check->reach[k], far = near + check->changes[check->lever_of[k]];
    if (middle && squared >= far * far) continue;
    /* NAN counts as near */
    if (!(squared >= near * near) && is_near(check, k)) {
      *check->last = k;
      return 0;
    }
    check->open[left++] = k;
  }
  *count = left;
  return 1;
}

/* `is_clear` with the share `part` / `count` of the way from `q` to `q_end` (n); counts the configurations, of which
   the first is the middle. */
static int is_clear_at(const Check *check, const double *q, const double *q_end, long part, long count, long *open,
                       long *checked) {
  const long n = check->shapes->frames - 1;
  const double share = (double)part / (double)count;
  double at[n];
  const int middle = ++*checked == 1;
  for (long i = 0; i < n; ++i) at[i] = (1 - share) * q[i] + share * q_end[i];
  return is_clear(check, at, middle, open);
}

/* Whether the pairs are far enough apart at the configurations with the shares 1/count, 2/count ... 1 of the way from
   `q` to `q_end` (n) [rad]. The first one is in the middle, where pairs are closed; the next is the end. Leaves in
   `checked` how many configurations were checked. */
long is_clear_between(const Check *check, const double *q, const double *q_end, long count, long *checked) {
  const long n = check->shapes->frames - 1, middle = count > 1 ? count / 2 : 1;
  long open = check->p, step = 1;
  for (long k = 0; k < open; ++k) check->open[k] = k;
  if (open > 0) {
    check->open[0] = *check->last;
    check->open[*check->last] = 0;
  }
  for (long r = 0; r < check->rows; ++r) {
    double change = 0.0;
    for (long i = 0; i < n; ++i) change += check->levers[n * r + i] * fabs(q_end[i] - q[i]);
    check->changes[r] = change * (double)(count - middle) / (double)count;
  }
  *checked = 0;
  if (!is_clear_at(check, q, q_end, middle, count, &open, checked)) return 0;
  if (middle < count && !is_clear_at(check, q, q_end, count, count, &open, checked)) return 0;
  while (2 * step < count) step *= 2;
  for (; step > 0; step /= 2)
    for (long part = step; part < count; part += 2 * step)
      if (part != middle && !is_clear_at(check, q, q_end, part, count, &open, checked)) return 0;
  return 1;
}
