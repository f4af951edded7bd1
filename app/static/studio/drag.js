// Handles in the picture: start, goal and obstacles are dragged; boxes are drawn on the floor. `/ik` says what is reached.
import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { post } from "./api.js";
import { Chain, cellOf, multiply, ofOrigin, ofPose, quaternionOf } from "./chain.js";
import { $, el } from "./dom.js";
import { problem, robotOf } from "./request.js";
import { follow, set, state } from "./store.js";

const HEIGHT = 0.2; // of a box that is drawn [m]
const ROUND = 1e4; // a tenth of a millimetre

let view, gizmo, handle, target;
let asking, waiting; // whether a request to /ik is on its way; the pose that is asked about next

export function createDrag(picture) {
  if (!picture) return;
  view = picture;
  handle = new THREE.Object3D();
  gizmo = new TransformControls(view.camera, view.renderer.domElement);
  gizmo.size = 0.75;
  view.handle = handle;
  view.scene.add(handle, gizmo.getHelper());
  gizmo.addEventListener("change", () => view.draw());
  gizmo.addEventListener("objectChange", () => isEnd(target) && reach(poseOfHandle()));
  gizmo.addEventListener("dragging-changed", ({ value }) => {
    view.controls.enabled = !value;
    if (!value) release();
  });
  $("drag").onchange = () => choose($("drag").value).catch(problem);
  $("turn").onchange = () => gizmo.setMode($("turn").checked ? "rotate" : "translate");
  $("draw-box").onclick = drawBox;
  follow("request answer", offer);
}

const tell = (text) => { $("drag-note").textContent = text; };

function offer() {
  const { scene, stops } = state.request ?? {};
  const list = (value) => (Array.isArray(value) ? value.map((each) => each ?? {}) : []); // what is edited may be of a wrong type
  const ends = stops ? list(stops).map((stop, k) => [`stop ${k}`, stop.target && stopName(stop, k)]).filter(([, name]) => name) : [["goal", "goal"]];
  const names = [["", "nothing"], ["start", "start"], ...ends, ...list(scene?.obstacles).map(({ name }, k) => [`${k}`, name])];
  $("drag").replaceChildren(...names.map(([value, text]) => el("option", { value }, text)));
  $("drag").value = names.some(([value]) => value === target) ? target : "";
  if (!$("drag").value) gizmo.detach();
}

const linkFrame = (robot, frame) => ofOrigin((frame === "base_link" && robot.kinematics.base_link_origin?.value) || [0, 0, 0, 0, 0, 0]);

/** A copy of a request with its obstacles in the base frame. */
const inBase = (request) => structuredClone(request.scene?.frame === "base_link" ? { ...request, scene: { ...request.scene, ...cellOf(request, state.robot).scene, frame: "base" } } : request);

/** The pose of what is dragged, in the base frame. */
function poseOf(chosen, robot) {
  const { request } = state;
  if (!isEnd(chosen)) return multiply(linkFrame(robot, request.scene.frame), ofPose(request.scene.obstacles[chosen].pose));
  const [parent, key] = endIn(request, chosen);
  const given = parent[key];
  if (given?.pose) return multiply(linkFrame(robot, given.pose.frame), ofPose(given.pose));
  return new Chain(robot).tcp(given?.q ?? answeredAt(chosen), request.tcp);
}

const stopName = ({ name }, k) => name ?? `${k + 1}`;

/** Start and goal, and the stops of a cycle; any other number is that of an obstacle. */
const isEnd = (name) => /[a-z]/.test(name);

/** Where an end stands in a request: the object, and its field. */
const endIn = (request, name) => (name.startsWith("stop ") ? [request.stops[name.slice(5)], "target"] : [request, name]);

/** Joint positions at an end of the motion that is shown. */
function answeredAt(name) {
  const { answer, cycle, request } = state;
  const [stop] = endIn(request, name);
  const places = cycle?.legs.flatMap(({ passes, goal }) => [...(passes ?? []), goal]);
  return (places?.find((place) => place.stop === stopName(stop, Number(name.slice(5)))) ?? answer.branch[name] ?? answer.branch.start).q;
}

async function choose(chosen) {
  target = chosen;
  tell("");
  if (state.best) set({ best: null });
  if (!chosen) return gizmo.detach(), view.draw();
  const robot = await robotOf(state.request.robot ?? "ur5e");
  const T = poseOf(chosen, robot);
  handle.position.set(T[3], T[7], T[11]);
  handle.quaternion.set(...quaternionOf(T));
  gizmo.attach(handle);
  view.draw();
}

const poseOfHandle = () => ({
  position: handle.position.toArray().map((value) => Math.round(value * ROUND) / ROUND),
  quaternion: handle.quaternion.normalize().toArray(),
});

/** Says whether a pose is reached, and draws how. While an answer is awaited, only the last pose waits. */
async function reach(pose) {
  waiting = pose;
  if (asking) return;
  asking = true;
  while (waiting) {
    const { tcp, tool, payload, robot = "ur5e", scene } = state.request;
    const asked = JSON.parse(JSON.stringify({ robot, tcp, tool, scene, pose: waiting }));
    if (payload?.shape) asked.payload = { shape: payload.shape, ...(payload.touches === undefined ? {} : { touches: payload.touches }) };
    waiting = null;
    try {
      tellReach((await post("ik", asked)).solutions, robot);
    } catch (error) {
      set({ best: null });
      tell(error.message);
    }
  }
  asking = false;
}

function tellReach(solutions, robot) {
  const free = solutions.filter(({ collides }) => !collides);
  const near = answeredAt(target);
  const far = ({ q }) => Math.hypot(...q.map((x, j) => x - near[j]));
  const [first] = (free.length ? free : solutions).toSorted((a, b) => far(a) - far(b));
  set({ best: first ? { robot, q_goal: first.q } : null });
  const collisions = free.length ? `${free.length} of them without a collision` : "all of them in a collision";
  tell(first ? `Reached by ${solutions.length} configurations, ${collisions}.` : "No configuration reaches it.");
}

/** Writes the new pose into the request, and asks whether it is reached. */
function release() {
  const pose = poseOfHandle();
  const request = inBase(state.request);
  const [parent, key] = isEnd(target) ? endIn(request, target) : [request.scene.obstacles[target], "pose"];
  parent[key] = isEnd(target) ? { pose } : pose;
  set({ request });
  if (isEnd(target)) reach(pose);
}

/** The next drag over the floor draws the ground of a box. */
function drawBox() {
  tell("Drag over the floor to draw the ground of a box.");
  gizmo.detach();
  view.controls.enabled = false;
  const before = inBase(state.request);
  const over = new AbortController();
  const on = (name, act) => view.renderer.domElement.addEventListener(name, act, { signal: over.signal });
  let first = null;
  on("pointerdown", (event) => { first = onFloor(event); });
  on("pointermove", (event) => {
    const last = first && onFloor(event);
    if (last) set({ request: withBox(before, first, last) });
  });
  on("pointerup", () => {
    over.abort();
    view.controls.enabled = true;
    tell("");
  });
}

/** The request with one more box, on the floor between two of its corners [x, y]. */
function withBox(request, first, last) {
  const rounded = (value) => Math.round(value * 1000) / 1000;
  const size = first.map((value, axis) => Math.max(0.01, rounded(Math.abs(last[axis] - value))));
  const position = first.map((value, axis) => rounded((value + last[axis]) / 2));
  const obstacles = request.scene?.obstacles ?? [];
  let k = 1;
  while (obstacles.some(({ name }) => name === `box ${k}`)) k += 1;
  const box = { name: `box ${k}`, shape: "box", size: [...size, HEIGHT], pose: { position: [...position, HEIGHT / 2], quaternion: [0, 0, 0, 1] } };
  return { ...request, scene: { ...request.scene, obstacles: [...obstacles, box] } };
}

/** The point [x, y] of the plane z = 0 under the pointer; null beside it. */
function onFloor(event) {
  const hit = view.eye.aim(event).ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Vector3());
  return hit && hit.length() < 5 ? [hit.x, hit.y] : null;
}
