/* Distance of two convex cores by GJK: E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A fast procedure for computing the
   distance between complex objects in three-dimensional space", IEEE Journal of Robotics and Automation, 1988.

   The simplex has corners b - a, of points a of the first and b of the second core, and comes nearer to the origin with
   every step. Everything is in the frame of the first body's link. */

/* Difference [m] of the upper and the lower bound on the distance at which the search ends, and its most steps. Cores
   nearer than LEAST [m] have no reliable normal. Triangles whose squared sine is below FLAT are left to their edges. */
static const double GAP = 1e-10, LEAST = 1e-7, FLAT = 1e-16;
enum { MOST_STEPS = 100 };

typedef struct {
  double difference[3], second[3]; /* b - a, and b */
} Corner;

/* The simplex: corners, and their shares in its point nearest to the origin. */
typedef struct {
  int count;
  Corner corners[4];
  double shares[4];
} Simplex;

/* The point of a core that is farthest along a direction, in the frame of its link. */
static void farthest(const Shapes *shapes, long body, const double *along, double *point) {
  const double *points = shapes->points + 3 * shapes->most_points * body, *best = points;
  double most = -INFINITY;
  for (long k = 0; k < shapes->counts[body]; ++k) {
    const double height = dot(points + 3 * k, along);
    if (height <= most) continue;
    most = height;
    best = points + 3 * k;
  }
  for (int i = 0; i < 3; ++i) point[i] = best[i];
  const double radius = shapes->disc_radii[body], *axis = shapes->axes + 3 * body;
  if (radius == 0) return;
  double in_disc[3] = {along[0], along[1], along[2]};
  /* twice, as the first difference may be little but rounding */
  for (int pass = 0; pass < 2; ++pass) {
    const double height = dot(in_disc, axis);
    for (int i = 0; i < 3; ++i) in_disc[i] -= height * axis[i];
    if (dot(in_disc, in_disc) <= NONE * dot(along, along)) return;
  }
  const double scale = radius / sqrt(dot(in_disc, in_disc));
  for (int i = 0; i < 3; ++i) point[i] += scale * in_disc[i];
}

/* Keeps the given corners if their point x is nearer to the origin than `least`. */
static void keep_nearer(const Simplex *from, int count, const int *which, const double *shares, const double *x,
                        double *least, Simplex *kept, double *nearest) {
  const double squared = dot(x, x);
  if (squared >= *least) return;
  *least = squared;
  kept->count = count;
  for (int i = 0; i < 3; ++i) nearest[i] = x[i];
  for (int k = 0; k < count; ++k) {
    kept->corners[k] = from->corners[which[k]];
    kept->shares[k] = shares[k];
  }
}

/* The edge between two corners: its point nearest to the origin. */
static void try_edge(const Simplex *from, int first, int last, double *least, Simplex *kept, double *nearest) {
  const double *a = from->corners[first].difference, *b = from->corners[last].difference;
  double u[3], x[3];
  for (int i = 0; i < 3; ++i) u[i] = b[i] - a[i];
  const double s = clipped(-dot(a, u) / greater(dot(u, u), NONE), 0, 1), shares[2] = {1 - s, s};
  const int which[2] = {first, last};
  for (int i = 0; i < 3; ++i) x[i] = a[i] + s * u[i];
  keep_nearer(from, 2, which, shares, x, least, kept, nearest);
}

/* The inner points of the triangle of three corners: the foot of the perpendicular from the origin, if it is inside. */
static void try_face(const Simplex *from, const int *which, double *least, Simplex *kept, double *nearest) {
  const double *a = from->corners[which[0]].difference;
  double u[3], v[3], n[3], x[3];
  for (int i = 0; i < 3; ++i) {
    u[i] = from->corners[which[1]].difference[i] - a[i];
    v[i] = from->corners[which[2]].difference[i] - a[i];
  }
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ua = -dot(u, a), va = -dot(v, a);
  cross(u, v, n);
  const double area = dot(n, n);
  if (area <= FLAT * uu * vv) return;
  const double s = (ua * vv - va * uv) / area, t = (va * uu - ua * uv) / area, shares[3] = {1 - s - t, s, t};
  if (shares[0] <= 0 || s <= 0 || t <= 0) return;
  for (int i = 0; i < 3; ++i) x[i] = dot(n, a) / area * n[i];
  keep_nearer(from, 3, which, shares, x, least, kept, nearest);
}

/* Whether the origin is inside four corners: on the same side of every face as the fourth corner. */
static int holds_origin(const Simplex *simplex) {
  for (int k = 0; k < 4; ++k) {
    const double *a = simplex->corners[k].difference, *b = simplex->corners[(k + 1) % 4].difference;
    const double *c = simplex->corners[(k + 2) % 4].difference, *d = simplex->corners[(k + 3) % 4].difference;
    double u[3], v[3], to[3], n[3];
    for (int i = 0; i < 3; ++i) {
      u[i] = b[i] - a[i];
      v[i] = c[i] - a[i];
      to[i] = d[i] - a[i];
    }
    cross(u, v, n);
    if (!(-dot(n, a) * dot(n, to) > 0)) return 0;
  }
  return 1;
}

/* Reduces the simplex to the corners that span its point nearest to the origin. That point is on a face or an edge with
   the last corner, or on the last corner itself. Returns whether the origin is outside. */
static int reduce(Simplex *simplex, double *nearest) {
  const int count = simplex->count, last = count - 1;
  if (count == 4 && holds_origin(simplex)) return 0;
  const double one = 1.0;
  double least = INFINITY;
  Simplex kept;
  keep_nearer(simplex, 1, &last, &one, simplex->corners[last].difference, &least, &kept, nearest);
  for (int i = 0; i < last; ++i) {
    try_edge(simplex, i, last, &least, &kept, nearest);
    for (int j = 0; j < i; ++j) try_face(simplex, (int[3]){i, j, last}, &least, &kept, nearest);
  }
  *simplex = kept;
  return 1;
}

/* Distance [m] of the cores of two bodies, unit normal from the first to the second, and the nearest point of the
   second. NAN if the cores touch or overlap, or if the search does not end. INFINITY as soon as they are proven to be
   farther apart than `within`: normal and point are then those of an early step. An upper bound as soon as that is at
   most `enough`. The search begins along `direction`, unless that is zero, and leaves its last direction there: both
   are in the frame of the first body's link. */
static double convex_convex(const Shapes *shapes, const double *frames, long configuration, long first, long second,
                            double within, double enough, double *direction, double *normal, double *point) {
  const double *A = frame_of(shapes, frames, configuration, first);
  const double *B = frame_of(shapes, frames, configuration, second);
  double x[3], at[3], *v = direction, before = INFINITY;
  if (dot(v, v) < NONE) {
    place(B, shapes->ball_centres + 3 * second, x);
    into(A, x, v);
    for (int i = 0; i < 3; ++i) v[i] -= shapes->ball_centres[3 * first + i];
  }
  if (dot(v, v) < NONE) v[0] = 1.0;
  Simplex simplex;
  simplex.count = 0;
  for (int step = 0; step < MOST_STEPS; ++step) {
    double along[3], in_base[3], in_second[3];
    farthest(shapes, first, v, at);
    turn(A, v, in_base);
    turn_back(B, in_base, along);
    for (int i = 0; i < 3; ++i) along[i] = -along[i];
    farthest(shapes, second, along, in_second);
    place(B, in_second, x);
    Corner *corner = simplex.corners + simplex.count;
    into(A, x, corner->second);
    for (int i = 0; i < 3; ++i) corner->difference[i] = corner->second[i] - at[i];
    const double squared = dot(v, v), distance = sqrt(squared), bound = dot(v, corner->difference) / distance;
    const int ends = simplex.count > 0 && (distance - bound <= GAP || distance <= enough);
    if (ends || bound > within) {
      double nearest[3] = {0.0, 0.0, 0.0}, away[3];
      for (int k = 0; k < simplex.count; ++k)
        for (int i = 0; i < 3; ++i) nearest[i] += simplex.shares[k] * simplex.corners[k].second[i];
      for (int i = 0; i < 3; ++i) away[i] = v[i] / distance;
      turn(A, away, normal);
      place(A, nearest, point);
      return ends ? distance : INFINITY;
    }
    if (simplex.count > 0) {
      if (squared >= before) return NAN;
      before = squared;
    }
    ++simplex.count;
    if (!reduce(&simplex, v) || dot(v, v) < LEAST * LEAST) return NAN;
  }
  return NAN;
}
