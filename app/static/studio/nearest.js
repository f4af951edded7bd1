// The nearest points of two bodies, for the eye: alternating projections between convex parts. The distance that is
// shown comes from the certificate.
import { inverse, moved, multiply, ofPose } from "./chain.js";
import { linkCapsules, linkNames } from "./links.js";

const ROUNDS = 400;
const clamp = (value, least, most) => Math.max(least, Math.min(most, value));
const add = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);

/** The two nearest points {first, second} of two bodies by name, at the link frames; null if one cannot be told. */
export function nearestPoints(request, robot, frames, [first, second]) {
  const ours = parts(request, robot, frames, first);
  const theirs = parts(request, robot, frames, second);
  let best = null;
  for (const a of ours)
    for (const b of theirs) {
      const pair = between(a, b);
      if (!best || pair.distance < best.distance) best = pair;
    }
  return best;
}

function between(a, b) {
  let p = b.centre;
  let q = p;
  for (let round = 0; round < ROUNDS; round++) {
    q = a.project(p);
    const next = b.project(q);
    const step = norm(add(next, p, -1));
    p = next;
    if (step < 1e-7) break;
  }
  return { first: q, second: p, distance: norm(add(q, p, -1)) };
}

/** The convex parts of a body: its centre, and the projection of a point onto it. */
function parts(request, robot, frames, name) {
  const link = linkNames(robot).indexOf(name);
  if (link >= 0) return linkCapsules(robot)[link].map((each) => capsulePart(frames[link], each));
  const flange = frames.at(-1);
  if (name === "tool")
    return (request.tool?.capsules ?? []).map(({ start, end, radius }) => capsulePart(flange, { from: start, to: end, radius }));
  if (name === "payload") return shapeParts(flange, request.payload?.shape);
  return shapeParts(null, (request.scene?.obstacles ?? []).find((each) => each.name === name));
}

function capsulePart(T, { from, to, radius }) {
  const [a, b] = [moved(T, from), moved(T, to)];
  const axis = add(b, a, -1);
  const square = axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2 || 1;
  return {
    centre: add(a, axis, 0.5),
    project(x) {
      const offset = add(x, a, -1);
      const share = clamp((offset[0] * axis[0] + offset[1] * axis[1] + offset[2] * axis[2]) / square, 0, 1);
      return towards(add(a, axis, share), x, radius);
    },
  };
}

/** The point of a ball that is nearest to x. */
function towards(centre, x, radius) {
  const offset = add(x, centre, -1);
  const distance = norm(offset);
  return distance <= radius ? x : add(centre, offset, radius / distance);
}

function shapeParts(parent, shape) {
  if (!shape) return [];
  const T = parent ? multiply(parent, ofPose(shape.pose)) : ofPose(shape.pose);
  const back = inverse(T);
  const inFrame = (local) => ({ centre: moved(T, [0, 0, 0]), project: (x) => moved(T, local(moved(back, x))) });
  const { radius, length } = shape;
  const half = (length ?? 0) / 2;
  switch (shape.shape) {
    case "box": return [inFrame((x) => x.map((value, axis) => clamp(value, -shape.size[axis] / 2, shape.size[axis] / 2)))];
    case "sphere": return [inFrame((x) => towards([0, 0, 0], x, radius))];
    case "capsule": return [capsulePart(T, { from: [0, 0, -half], to: [0, 0, half], radius })];
    case "half_space": return [inFrame(([x, y, z]) => [x, y, Math.min(z, 0)])];
    case "cylinder": return [inFrame(([x, y, z]) => {
      const aside = Math.hypot(x, y);
      const share = aside > radius ? radius / aside : 1;
      return [x * share, y * share, clamp(z, -half, half)];
    })];
    case "points": return shape.points.map((point) => ({ centre: moved(T, point), project: (x) => towards(moved(T, point), x, radius) })).slice(0, 3000);
    default: return []; // hulls, voxels and files: the pair is named, without a line
  }
}
