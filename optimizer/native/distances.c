/* Distances between bodies at many configurations, one pair after the other.

   The shapes of the arguments are those of optimizer/collision/compiled_distances.py. The signed distance of two convex
   bodies a and b is the maximum over unit vectors n of min n·x over b - max n·x over a. If they are apart, it is their
   distance; if they overlap, minus the length of the shortest translation that separates them. The n that attains the
   maximum is the unit normal, from a to b.

   Two segments: C. Ericson, "Real-Time Collision Detection", 2005, 5.1.9. */

#define BEADS 4

/* the order of PairKind */
enum { SEGMENT_SEGMENT, BOX_SEGMENT, SEGMENT_BOX, HALF_SPACE, CONVEX };

/* Cores nearer than this [m] touch: the direction from one to the other is only rounding. Segments whose squared sine is
   below PARALLEL count as parallel: if they nearly touch, the nearest points may then be off by a ten-millionth of their
   lengths. A vector of a squared length [m²] below NONE has no direction. */
static const double TOUCHING = 1e-10, PARALLEL = 1e-15, NONE = 1e-24;

/* Bodies b and their pairs p: see PairArrays in pair_arrays.py, and compiled_distances.py, which has the same order. */
typedef struct {
  long frames, bodies, most_points; /* frames of a configuration, bodies, most points of a body */
  const long *first, *second, *kinds;
  const double *growth;
  const long *links, *counts;
  const double *points, *ball_centres, *ball_radii, *axes, *disc_radii, *half_sizes, *T_link_core;
  const long *formed, *beaded;
  const double *bead_centres, *bead_radii, *form_sizes;
  const long *is_round;
} Shapes;

/* Length [m] of a vector, and its direction. */
static double length_of(const double *across, double *normal) {
  const double length = sqrt(dot(across, across));
  for (int i = 0; i < 3; ++i) normal[i] = across[i] / length;
  return length;
}

static const double *frame_of(const Shapes *shapes, const double *frames, long configuration, long body) {
  return frames + 16 * (shapes->frames * configuration + shapes->links[body]);
}

/* Lower bound [m] on the distance of the cores of a pair by beads, but for radii; -INFINITY if there is none. */
static double bead_bound(const Shapes *shapes, const double *frames, long configuration, long pair) {
  const long formed = shapes->formed[pair], beaded = shapes->beaded[pair];
  if (formed < 0) return -INFINITY;
  const double *of_beads = frame_of(shapes, frames, configuration, beaded);
  const double *of_form = frame_of(shapes, frames, configuration, formed), *half = shapes->form_sizes + 3 * formed;
  double least = INFINITY;
  for (int k = 0; k < BEADS; ++k) {
    double at[3], in_link[3], x[3], outside[3];
    place(of_beads, shapes->bead_centres + 3 * (BEADS * beaded + k), at);
    into(of_form, at, in_link);
    into(shapes->T_link_core + 16 * formed, in_link, x);
    if (shapes->is_round[formed]) {
      x[0] = sqrt(x[0] * x[0] + x[1] * x[1]);
      x[1] = 0.0;
    }
    for (int i = 0; i < 3; ++i) outside[i] = greater(fabs(x[i]) - half[i], 0.0);
    least = lesser(least, dot(outside, outside));
  }
  const double bound = sqrt(least) - shapes->bead_radii[beaded];
  return bound > 0 ? bound : -INFINITY;
}

/* Lower bound [m] on the distance of the cores of a pair by balls around them, with centres (bodies, 3) in the base
   frame. */
static double ball_bound(const Shapes *shapes, const double *centre, long pair) {
  const long first = shapes->first[pair], second = shapes->second[pair];
  double across[3];
  if (shapes->kinds[pair] == HALF_SPACE) {
    const double *origin = shapes->points + 3 * shapes->most_points * first;
    for (int i = 0; i < 3; ++i) across[i] = centre[3 * second + i] - origin[i];
    return dot(across, shapes->axes + 3 * first) - shapes->ball_radii[second];
  }
  for (int i = 0; i < 3; ++i) across[i] = centre[3 * second + i] - centre[3 * first + i];
  return sqrt(dot(across, across)) - shapes->ball_radii[first] - shapes->ball_radii[second];
}

/* Lower bounds (n, p) on the distances of pairs (p), at first those in `distance` if `known`. Where they are at most
   `within`, balls improve them, and beads if `within` is finite. Returns how many are left at most as great: their
   `row` and `column`. `centre` has room for (bodies, 3). */
long bounds(const Shapes *shapes, long n, const double *frames, long p, const long *pairs, double within, long known,
            double *distance, long *row, long *column, double *centre) {
  long found = 0;
  for (long c = 0; c < n; ++c) {
    for (long b = 0; b < shapes->bodies; ++b)
      place(frame_of(shapes, frames, c, b), shapes->ball_centres + 3 * b, centre + 3 * b);
    for (long k = 0; k < p; ++k) {
      const long pair = pairs[k];
      double *at = distance + c * p + k;
      if (known && *at > within) continue;
      double bound = -INFINITY;
      if (shapes->kinds[pair] != HALF_SPACE) bound = ball_bound(shapes, centre, pair) - shapes->growth[pair];
      *at = known ? greater(*at, bound) : bound;
      if (*at > within) continue;
      if (isfinite(within)) {
        *at = greater(*at, bead_bound(shapes, frames, c, pair) - shapes->growth[pair]);
        if (*at > within) continue;
      }
      row[found] = c;
      column[found++] = k;
    }
  }
  return found;
}

/* Lower bounds (k) [m] on the distances of pairs (k) at configurations (k) by beads; -INFINITY where there is none. */
void bead_bounds(const Shapes *shapes, const double *frames, long k, const long *configuration, const long *pair,
                 double *bound) {
  for (long j = 0; j < k; ++j)
    bound[j] = bead_bound(shapes, frames, configuration[j], pair[j]) - shapes->growth[pair[j]];
}

/* A unit vector perpendicular to u and v; if these are parallel, any one perpendicular to u. */
static void perpendicular(const double *u, const double *v, double *normal) {
  double across[3], least[3] = {0.0, 0.0, 0.0};
  cross(u, v, across);
  if (dot(across, across) < NONE) {
    int k = fabs(u[1]) < fabs(u[0]) ? 1 : 0;
    if (fabs(u[2]) < fabs(u[k])) k = 2;
    least[k] = 1.0;
    cross(u, least, across);
  }
  if (dot(across, across) < NONE) {
    across[0] = across[1] = 0.0;
    across[2] = 1.0;
  }
  length_of(across, normal);
}

/* Distance [m] of segments (2, 3), unit normal from a to b and the nearest point of b. The point of a that is nearest to
   the line of b, clamped, then the point of b nearest to it, clamped, and the point of a nearest to that: exact, also
   for parallel segments, but for those that are nearly so. If they cross, the normal is the common perpendicular. */
static double segment_segment(const double *a, const double *b, double *normal, double *point) {
  double u[3], v[3], w[3], across[3];
  for (int i = 0; i < 3; ++i) {
    u[i] = a[3 + i] - a[i];
    v[i] = b[3 + i] - b[i];
    w[i] = a[i] - b[i];
  }
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const double denominator = uu * vv - uv * uv;
  double s = denominator > PARALLEL * uu * vv ? clipped((uv * vw - vv * uw) / denominator, 0, 1) : 0.0;
  const double t = clipped((uv * s + vw) / greater(vv, NONE), 0, 1);
  s = clipped((uv * t - uw) / greater(uu, NONE), 0, 1);
  for (int i = 0; i < 3; ++i) {
    point[i] = b[i] + t * v[i];
    across[i] = point[i] - (a[i] + s * u[i]);
  }
  const double distance = length_of(across, normal);
  if (distance < TOUCHING) perpendicular(u, v, normal);
  return distance;
}

/* Derivative of half the squared distance of p + s u from a box of half size h, by s. */
static double slope(const double *p, const double *u, const double *h, double s) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double x = p[i] + s * u[i];
    sum += (x - clipped(x, -h[i], h[i])) * u[i];
  }
  return sum;
}

/* The signed distance [m] of `box_segment` where the segment meets the box. The candidates for the normal are those of
   the facets of the box swept along the segment. */
static double penetration(const double *h, const double *b, const double *u, double *normal, double *point) {
  static const double unit[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  double deepest = -INFINITY;
  int edge = -1;
  for (int k = 0; k < 12; ++k) {
    /* faces, edges, and their opposites */
    const int side = k % 3, is_edge = k % 6 >= 3;
    double n[3];
    if (is_edge) cross(u, unit[side], n);
    if (!is_edge || length_of(n, n) <= 1e-9)
      for (int i = 0; i < 3; ++i) n[i] = unit[side][i];
    if (k >= 6)
      for (int i = 0; i < 3; ++i) n[i] = -n[i];
    const double first = dot(n, b), last = dot(n, b + 3);
    const double depth = lesser(first, last) - (fabs(n[0]) * h[0] + fabs(n[1]) * h[1] + fabs(n[2]) * h[2]);
    if (!(depth > deepest)) continue;
    deepest = depth;
    edge = is_edge ? side : -1;
    for (int i = 0; i < 3; ++i) {
      normal[i] = n[i];
      point[i] = b[last < first ? 3 + i : i];
    }
  }
  if (edge < 0) return deepest;
  /* where segment and edge cross, seen along the normal */
  double across[3], to_edge[3];
  cross(normal, unit[edge], across);
  for (int i = 0; i < 3; ++i) to_edge[i] = (normal[i] > 0 ? h[i] : normal[i] < 0 ? -h[i] : 0.0) - b[i];
  const double slope = dot(u, across);
  const double s = clipped(dot(to_edge, across) / (slope == 0 ? 1.0 : slope), 0, 1);
  for (int i = 0; i < 3; ++i) point[i] = b[i] + s * u[i];
  return deepest;
}

/* Signed distance [m] of a segment b (2, 3) from a box of half size h about the origin, unit normal from the box and the
   nearest point of the segment. The derivative of half the squared distance along the segment is piecewise linear and
   increasing: its root is exact. */
static double box_segment(const double *h, const double *b, double *normal, double *point) {
  double u[3], bends[8] = {0.0, 1.0}, low = 0.0, high = 1.0;
  int many = 2;
  for (int i = 0; i < 3; ++i) {
    u[i] = b[3 + i] - b[i];
    if (fabs(u[i]) <= 1e-15) continue;
    bends[many++] = clipped((h[i] - b[i]) / u[i], 0, 1);
    bends[many++] = clipped((-h[i] - b[i]) / u[i], 0, 1);
  }
  for (int k = 0; k < many; ++k) {
    if (slope(b, u, h, bends[k]) < 0)
      low = greater(low, bends[k]);
    else
      high = lesser(high, bends[k]);
  }
  const double g0 = slope(b, u, h, low), g1 = slope(b, u, h, high);
  const double s = low + (g0 < 0 && g1 > 0 ? -g0 / (g1 - g0) : 1.0) * (high - low);
  double across[3];
  for (int i = 0; i < 3; ++i) {
    point[i] = b[i] + s * u[i];
    across[i] = point[i] - clipped(point[i], -h[i], h[i]);
  }
  const double distance = length_of(across, normal);
  return distance < TOUCHING ? penetration(h, b, u, normal, point) : distance;
}

/* Of k pairs of segments (k, 2, 3): their distances (k), normals (k, 3), and points of b (k, 3). */
void segment_segments(long k, const double *a, const double *b, double *distance, double *normal, double *point) {
  for (long j = 0; j < k; ++j) distance[j] = segment_segment(a + 6 * j, b + 6 * j, normal + 3 * j, point + 3 * j);
}

/* Of boxes about the origin with half sizes (k, 3) and segments (k, 2, 3): distances (k), normals and points (k, 3). */
void box_segments(long k, const double *half, const double *b, double *distance, double *normal, double *point) {
  for (long j = 0; j < k; ++j) distance[j] = box_segment(half + 3 * j, b + 6 * j, normal + 3 * j, point + 3 * j);
}

/* The ends (2, 3) of a segment in the base frame. */
static void segment_ends(const Shapes *shapes, const double *frames, long configuration, long body, double *ends) {
  const double *T = frame_of(shapes, frames, configuration, body), *x = shapes->points + 3 * shapes->most_points * body;
  place(T, x, ends);
  place(T, x + 3 * (shapes->counts[body] - 1), ends + 3);
}

static double box_and_segment(const Shapes *shapes, const double *frames, long configuration, long box, long segment,
                              double *normal, double *point) {
  const double *T = frame_of(shapes, frames, configuration, box), *in_link = shapes->T_link_core + 16 * box;
  double ends[6], local[6], of_link[3], n[3], x[3];
  segment_ends(shapes, frames, configuration, segment, ends);
  for (int k = 0; k < 2; ++k) {
    into(T, ends + 3 * k, of_link);
    into(in_link, of_link, local + 3 * k);
  }
  const double distance = box_segment(shapes->half_sizes + 3 * box, local, n, x);
  turn(in_link, n, of_link);
  turn(T, of_link, normal);
  place(in_link, x, of_link);
  place(T, of_link, point);
  return distance;
}

/* Signed height [m] of the lowest point of a body above a half-space, its outward normal, and that point. */
static double half_space(const Shapes *shapes, const double *frames, long configuration, long ground, long body,
                         double *normal, double *point) {
  const double *T = frame_of(shapes, frames, configuration, body);
  const double *origin = shapes->points + 3 * shapes->most_points * ground;
  const double *up = shapes->axes + 3 * ground;
  double least = INFINITY, axis[3], in_disc[3];
  for (long k = 0; k < shapes->counts[body]; ++k) {
    double x[3], above[3];
    place(T, shapes->points + 3 * (shapes->most_points * body + k), x);
    for (int i = 0; i < 3; ++i) above[i] = x[i] - origin[i];
    const double height = dot(above, up);
    if (height >= least) continue;
    least = height;
    for (int i = 0; i < 3; ++i) point[i] = x[i];
  }
  turn(T, shapes->axes + 3 * body, axis);
  const double cosine = dot(axis, up), radius = shapes->disc_radii[body];
  for (int i = 0; i < 3; ++i) in_disc[i] = up[i] - cosine * axis[i];
  const double sine = sqrt(dot(in_disc, in_disc));
  for (int i = 0; i < 3; ++i) {
    point[i] -= radius / greater(sine, 1e-12) * in_disc[i];
    normal[i] = up[i];
  }
  return least - radius * sine;
}

#include "convex.c"

/* Signed distance, normal and point (3) of a pair; `within`, `enough` and `direction` are those of `convex_convex`.
   NAN where Coal or a cloud computes it. */
static double pair_distance(const Shapes *shapes, const double *frames, long c, long pair, double within, double enough,
                            double *direction, double *normal, double *point) {
  const long first = shapes->first[pair], second = shapes->second[pair];
  double found = NAN, a[6], b[6];
  switch (shapes->kinds[pair]) {
    case SEGMENT_SEGMENT:
      segment_ends(shapes, frames, c, first, a);
      segment_ends(shapes, frames, c, second, b);
      return segment_segment(a, b, normal, point);
    case BOX_SEGMENT:
      return box_and_segment(shapes, frames, c, first, second, normal, point);
    case SEGMENT_BOX:
      found = box_and_segment(shapes, frames, c, second, first, normal, point);
      for (int i = 0; i < 3; ++i) normal[i] = -normal[i];
      return found;
    case HALF_SPACE:
      return half_space(shapes, frames, c, first, second, normal, point);
    case CONVEX:
      return convex_convex(shapes, frames, c, first, second, within, enough, direction, normal, point);
  }
  return found;
}

/* Signed distances (k), normals and points (k, 3) of pairs (k) at configurations (k). NAN where Coal or a cloud computes
   them; INFINITY for convex cores without a closed form that are farther apart than `within` and the pair's growth. */
void witness_points(const Shapes *shapes, const double *frames, long k, const long *configuration, const long *pair,
                    double within, double *distance, double *normal, double *point) {
  for (long j = 0; j < k; ++j) {
    double direction[3] = {0.0, 0.0, 0.0};
    distance[j] = pair_distance(shapes, frames, configuration[j], pair[j], within + shapes->growth[pair[j]], -INFINITY,
                                direction, normal + 3 * j, point + 3 * j);
  }
}

/* min n·x [m] over the core of a body; n is in the base frame. */
static double support(const Shapes *shapes, const double *frames, long configuration, long body, const double *n) {
  const double *T = frame_of(shapes, frames, configuration, body), *x = shapes->points + 3 * shapes->most_points * body;
  const double shift = T[3] * n[0] + T[7] * n[1] + T[11] * n[2];
  double in_link[3], least = INFINITY;
  turn_back(T, n, in_link);
  for (long k = 0; k < shapes->counts[body]; ++k) least = lesser(least, dot(x + 3 * k, in_link));
  if (shapes->disc_radii[body] > 0) {
    const double cosine = dot(shapes->axes + 3 * body, in_link);
    least -= shapes->disc_radii[body] * sqrt(greater(1 - cosine * cosine, 0.0));
  }
  return least + shift;
}

/* min n·x (k) [m] over the cores of bodies (k) at configurations (k), for unit vectors n (k, 3) in the base frame. */
void supports(const Shapes *shapes, const double *frames, long k, const long *configuration, const long *body,
              const double *normal, double *result) {
  for (long j = 0; j < k; ++j) result[j] = support(shapes, frames, configuration[j], body[j], normal + 3 * j);
}

/* Separation [m] of a pair along n, which is given in the frame of its first body's link. */
static double separation(const Shapes *shapes, const double *frames, long configuration, long pair, const double *n) {
  const long first = shapes->first[pair], second = shapes->second[pair];
  double normal[3], opposite[3];
  turn(frame_of(shapes, frames, configuration, first), n, normal);
  for (int i = 0; i < 3; ++i) opposite[i] = -normal[i];
  const double apart = support(shapes, frames, configuration, second, normal);
  return apart + support(shapes, frames, configuration, first, opposite) - shapes->growth[pair];
}

/* The lesser separation [m] of a pair at two configurations, along a normal at `from` that moves with its first body. */
static double held(const Shapes *shapes, const double *frames, long begin, long end, long pair, long from,
                   const double *normal) {
  double n[3];
  turn_back(frame_of(shapes, frames, from, shapes->first[pair]), normal, n);
  return lesser(separation(shapes, frames, begin, pair, n), separation(shapes, frames, end, pair, n));
}

/* For pairs (k) between configurations `begin` and `end` (k), and unit normals there (k, 3): what is held by the better
   normal, (k) [m]. */
void separations(const Shapes *shapes, const double *frames, long k, const long *begin, const long *end,
                 const long *pair, const double *normal_begin, const double *normal_end, double *result) {
  for (long j = 0; j < k; ++j, normal_begin += 3, normal_end += 3)
    result[j] = greater(held(shapes, frames, begin[j], end[j], pair[j], begin[j], normal_begin),
                        held(shapes, frames, begin[j], end[j], pair[j], end[j], normal_end));
}

/* Gradients (k, nq) [m/rad] of the distances of pairs (k) with these unit normals and witness points (k, 3). */
void gradients(const Shapes *shapes, const double *frames, long k, const long *configuration, const long *pair,
               const double *normal, const double *point, double *result) {
  const long nq = shapes->frames - 1;
  for (long j = 0; j < k; ++j, normal += 3, point += 3, result += nq) {
    const long below = shapes->links[shapes->first[pair[j]]], last = shapes->links[shapes->second[pair[j]]];
    for (long i = 0; i < nq; ++i) {
      const double *T = frames + 16 * (shapes->frames * configuration[j] + i + 1);
      const double x = point[0] - T[3], y = point[1] - T[7], z = point[2] - T[11];
      result[i] = i < below || i >= last ? 0.0
                                         : normal[0] * (T[6] * z - T[10] * y) + normal[1] * (T[10] * x - T[2] * z) +
                                               normal[2] * (T[2] * y - T[6] * x);
    }
  }
}
