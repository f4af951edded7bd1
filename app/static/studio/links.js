// The form of an arm from its own figures: tubes between the joints, round housings with caps at them. No drawing here.
import { IDENTITY, moved, ofOrigin, turned } from "./chain.js";

const SAMPLES = 9;
// of a capsule's radius: how near its axis is to the joint's, to count as the joint's housing
const NEAR = 0.7;
// the capsules hold the meshes, so that what they hold is a little slimmer
const SLIMMER = 0.94;

const add = (a, b, k = 1) => a.map((value, i) => value + k * b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const length = (a) => Math.sqrt(dot(a, a));

/** Names of the links, base first. */
export const linkNames = (robot) => ["base", ...robot.kinematics.link_names.value];

/** The capsules of every link, base first: [{from, to, radius}] in the link's frame. */
export function linkCapsules(robot) {
  return linkNames(robot).map((name) =>
    (robot.collision[name]?.value ?? []).map((row) => ({ from: row.slice(0, 3), to: row.slice(3, 6), radius: row[6] })),
  );
}

/** Bodies of every link, base first: {kind: "housing" | "tube" | "cap" | "ring" | "foot", from, to, radius}. */
export function linkBodies(robot) {
  const capsules = linkCapsules(robot);
  const placements = robot.kinematics.joint_origin.value.map(ofOrigin);
  const lengths = placements.map((T) => length([T[3], T[7], T[11]]));
  const typical = Math.max(...lengths) / 8;
  const bodies = capsules.map(() => []);
  // the housings of both links at every joint, about the same axis and measured from the same point
  const housings = placements.map((placement, joint) => {
    const of = (link, T) => housing(capsules[link], T, typical);
    return [of(joint, placement), of(joint + 1, IDENTITY)];
  });
  housings.forEach((pair) => meet(...pair));
  // nothing of the base is below the ground that it stands on
  const [up, height, foot] = [placements[0][10], placements[0][11], housings[0][0]];
  if (up > 0.99) foot.low = Math.max(foot.low, -height);
  if (up < -0.99) foot.high = Math.min(foot.high, height);
  housings.forEach((pair, joint) => {
    pair.forEach((each, side) => {
      const T = side === 0 ? placements[joint] : IDENTITY;
      bodies[joint + side].push(...housingBodies(each, pair[1 - side], T, side));
    });
  });
  capsules.forEach((own, link) => {
    const ends = [];
    if (link > 0) ends.push(middle(housings[link - 1][1], IDENTITY));
    else ends.push({ at: [0, 0, 0], radius: housings[0][0].radius });
    if (link < placements.length) ends.push(middle(housings[link][0], placements[link]));
    else ends.push(flangeEnd(robot, housings.at(-1)[1]));
    bodies[link].push(...tube(own, ...ends, link));
  });
  bodies[0].push({ kind: "foot", from: [0, 0, 0], to: [0, 0, 0.02], radius: housings[0][0].radius * 1.22 });
  return bodies;
}

/** The part {low, high, radius} along an axis, the z axis of T, that a link's capsules fill around it. */
function housing(capsules, T, typical) {
  const [origin, axis] = [moved(T, [0, 0, 0]), turned(T, [0, 0, 1])];
  let [low, high, radius, nearest] = [Infinity, -Infinity, 0, null];
  for (const { from, to, radius: r } of capsules) {
    for (let k = 0; k < SAMPLES; k++) {
      const offset = add(add(from, add(to, from, -1), k / (SAMPLES - 1)), origin, -1);
      const along = dot(offset, axis);
      const aside = length(add(offset, axis, -along));
      if (!nearest || aside < nearest.aside) nearest = { aside, along, radius: r };
      if (aside > NEAR * r) continue;
      low = Math.min(low, along - 0.8 * r);
      high = Math.max(high, along + 0.8 * r);
      radius = Math.max(radius, SLIMMER * Math.sqrt(Math.max(r * r - aside * aside, 0.4 * r * r)));
    }
  }
  if (radius > 0) return { low, high, radius };
  const small = nearest ? Math.min(0.7 * nearest.radius, typical) : typical / 2;
  return { low: -small, high: small, radius: small };
}

/** Lets the two housings at a joint end where they meet. */
function meet(first, second) {
  const [lower, upper] = first.low + first.high < second.low + second.high ? [first, second] : [second, first];
  const border = Math.max(lower.low + 0.3 * lower.radius, Math.min((lower.high + upper.low) / 2, upper.high - 0.3 * upper.radius));
  lower.high = upper.low = border;
  const slim = Math.min(lower.radius, upper.radius);
  lower.radius = Math.min(lower.radius, 1.3 * slim);
  upper.radius = Math.min(upper.radius, 1.3 * slim);
}

const between = (T, low, high, radius, kind) => ({ kind, from: moved(T, [0, 0, low]), to: moved(T, [0, 0, high]), radius });

function housingBodies(own, other, T, side) {
  const outward = own.low + own.high < other.low + other.high ? -1 : 1;
  const [inner, outer] = outward > 0 ? [own.low, own.high] : [own.high, own.low];
  const edge = outer - outward * 0.16 * own.radius;
  const bodies = [between(T, inner, edge, own.radius, "housing"), between(T, edge, outer, own.radius * 0.9, "cap")];
  const gap = 0.035 * own.radius;
  if (side === 0) bodies.push(between(T, inner - gap, inner + gap, Math.min(own.radius, other.radius) * 1.015, "ring"));
  return bodies;
}

const middle = ({ low, high, radius }, T) => ({ at: moved(T, [0, 0, (low + high) / 2]), radius });

function flangeEnd(robot, last) {
  const T = ofOrigin(robot.kinematics.flange_origin.value);
  return { at: [T[3], T[7], T[11]], radius: 0.8 * last.radius };
}

/** The tube between two ends of a link, as thick as its long capsules; none where the ends overlap. */
function tube(capsules, first, second, link) {
  const span = length(add(second.at, first.at, -1));
  if (span < 0.35 * (first.radius + second.radius)) return [];
  const long = capsules.filter(({ from, to }) => length(add(to, from, -1)) > 0.4 * span).map(({ radius }) => radius);
  const widest = 0.92 * Math.min(first.radius, second.radius);
  const radius = link === 0 ? widest : Math.min(widest, long.length ? SLIMMER * Math.max(...long) : widest * 0.8);
  return [{ kind: "tube", from: first.at, to: second.at, radius }];
}
