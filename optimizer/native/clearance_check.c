/* Whether pairs of bodies are far enough apart at one configuration, without their distances. */

/* Whether a pair is nearer than `reserve`. `direction` is that of `convex_convex`: begun along the last one, most
   searches prove at their first step that the cores are apart. */
static int is_near(const Shapes *shapes, const double *frames, const double *centre, long pair, double reserve,
                   double *direction) {
  const double least = reserve + shapes->growth[pair];
  double normal[3], point[3];
  if (ball_bound(shapes, centre, pair) >= least || bead_bound(shapes, frames, 0, pair) >= least) return 0;
  /* NAN for cores that touch or overlap */
  return !(pair_distance(shapes, frames, 0, pair, least, least, direction, normal, point) >= least);
}

/* Whether none of the pairs (p) is nearer than `reserve` at q (n) [rad]. Leaves there the `frames` (n + 1, 4, 4), the
   `directions` (p, 3) of the searches, and the `last` place among the pairs of one that was near, which is first here.
   `centre` has room for (bodies, 3). */
long keeps_clear(const Shapes *shapes, const double *placements, const double *q, long p, const long *pairs,
                 double reserve, double *frames, double *directions, long *last, double *centre) {
  link_frames(1, shapes->frames - 1, placements, q, frames);
  for (long b = 0; b < shapes->bodies; ++b)
    place(frame_of(shapes, frames, 0, b), shapes->ball_centres + 3 * b, centre + 3 * b);
  for (long k = 0; k < p; ++k) {
    const long at = k == 0 ? *last : k == *last ? 0 : k;
    if (!is_near(shapes, frames, centre, pairs[at], reserve, directions + 3 * at)) continue;
    *last = at;
    return 0;
  }
  return 1;
}
