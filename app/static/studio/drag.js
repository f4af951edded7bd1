// Handles in the picture: start, goal and obstacles are dragged; boxes are drawn on the floor. `/ik` says what is reached.
import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { post } from "./api.js";
import { Chain, multiply, ofOrigin, ofPose, quaternionOf } from "./chain.js";
import { $, el } from "./dom.js";
import { robotOf, setRequest } from "./request.js";
import { follow, state } from "./store.js";

const HEIGHT = 0.2; // of a box that is drawn [m]
const ROUND = 1e4; // a tenth of a millimetre

let view, gizmo, handle, target;

export function createDrag(picture) {
  if (!picture) return;
  view = picture;
  handle = new THREE.Object3D();
  gizmo = new TransformControls(view.camera, view.renderer.domElement);
  gizmo.size = 0.75;
  view.handle = handle;
  view.scene.add(handle, gizmo.getHelper());
  gizmo.addEventListener("change", () => view.draw());
  gizmo.addEventListener("dragging-changed", ({ value }) => {
    view.controls.enabled = !value;
    if (!value) release().catch((error) => tell(error.message));
  });
  $("drag").onchange = () => choose($("drag").value);
  $("turn").onchange = () => gizmo.setMode($("turn").checked ? "rotate" : "translate");
  $("draw-box").onclick = drawBox;
  follow("request answer", offer);
}

const tell = (text) => { $("drag-note").textContent = text; };

function offer() {
  const obstacles = state.request?.scene?.obstacles ?? [];
  const names = [["", "nothing"], ["start", "start"], ["goal", "goal"], ...obstacles.map(({ name }, k) => [`${k}`, name])];
  $("drag").replaceChildren(...names.map(([value, text]) => el("option", { value }, text)));
  $("drag").value = names.some(([value]) => value === target) ? target : "";
  if (!$("drag").value) gizmo.detach();
}

const linkFrame = (robot, frame) => ofOrigin((frame === "base_link" && robot.kinematics.base_link_origin?.value) || [0, 0, 0, 0, 0, 0]);

/** The pose of what is dragged, in the base frame. */
function poseOf(chosen, robot) {
  const { request } = state;
  if (chosen !== "start" && chosen !== "goal") return multiply(linkFrame(robot, request.scene.frame), ofPose(request.scene.obstacles[chosen].pose));
  const given = request[chosen];
  if (given?.pose) return multiply(linkFrame(robot, given.pose.frame), ofPose(given.pose));
  const q = given?.q ?? state.answer.branch[chosen].q;
  return new Chain(robot).tcp(q, request.tcp);
}

async function choose(chosen) {
  target = chosen;
  tell("");
  if (!chosen) return gizmo.detach(), view.draw();
  const robot = await robotOf(state.request.robot ?? "ur5e");
  const T = poseOf(chosen, robot);
  handle.position.set(T[3], T[7], T[11]);
  handle.quaternion.set(...quaternionOf(T));
  gizmo.attach(handle);
  view.draw();
}

/** Writes the new pose into the request, and asks whether it is reached. */
async function release() {
  const round = (value) => Math.round(value * ROUND) / ROUND;
  const norm = handle.quaternion.normalize().toArray();
  const pose = { position: handle.position.toArray().map(round), quaternion: norm };
  const request = structuredClone(state.request);
  if (target === "start" || target === "goal") {
    request[target] = { pose };
    setRequest(request);
    const { tcp, tool, payload, robot = "ur5e", scene } = request;
    const asked = JSON.parse(JSON.stringify({ robot, tcp, tool, scene, pose }));
    if (payload?.shape) asked.payload = { shape: payload.shape, ...(payload.touches === undefined ? {} : { touches: payload.touches }) };
    const { solutions } = await post("ik", asked);
    const free = solutions.filter(({ collides }) => !collides).length;
    tell(solutions.length ? `Reached by ${solutions.length} configurations, ${free} of them without a collision.` : "No configuration reaches it.");
  } else {
    if (request.scene.frame === "base_link") delete request.scene.frame, request.scene.obstacles = state.cell.scene.obstacles;
    request.scene.obstacles[target].pose = pose;
    setRequest(request);
  }
}

/** The next drag over the floor draws the ground of a box. */
function drawBox() {
  tell("Drag over the floor to draw the ground of a box.");
  gizmo.detach();
  view.controls.enabled = false;
  const canvas = view.renderer.domElement;
  const material = new THREE.MeshLambertMaterial({ color: 0x3b7dd8, transparent: true, opacity: 0.5 });
  const ghost = new THREE.Mesh(new THREE.BoxGeometry(1, 1, HEIGHT), material);
  let first = null;
  const box = (last) => {
    const [x, y] = [0, 1].map((axis) => [Math.min(first[axis], last[axis]), Math.max(first[axis], last[axis])]);
    const size = [x[1] - x[0], y[1] - y[0], HEIGHT].map((edge) => Math.max(0.01, Math.round(edge * 1000) / 1000));
    return { size, position: [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2, HEIGHT / 2].map((value) => Math.round(value * 1000) / 1000) };
  };
  const stretch = (event) => {
    const last = onFloor(event);
    if (!first || !last) return;
    const { size, position } = box(last);
    ghost.scale.set(size[0], size[1], 1);
    ghost.position.set(...position);
    view.draw();
  };
  const begin = (event) => {
    first = onFloor(event);
    if (first) view.scene.add(ghost);
  };
  const end = (event) => {
    const last = onFloor(event);
    for (const [name, listener] of [["pointerdown", begin], ["pointermove", stretch], ["pointerup", end]]) canvas.removeEventListener(name, listener);
    view.scene.remove(ghost);
    view.controls.enabled = true;
    tell("");
    if (first && last) addBox(box(last));
  };
  for (const [name, listener] of [["pointerdown", begin], ["pointermove", stretch], ["pointerup", end]]) canvas.addEventListener(name, listener);
}

function addBox({ size, position }) {
  const request = structuredClone(state.request);
  request.scene ??= {};
  request.scene.obstacles ??= [];
  let k = 1;
  while (request.scene.obstacles.some(({ name }) => name === `box ${k}`)) k += 1;
  request.scene.obstacles.push({ name: `box ${k}`, shape: "box", size, pose: { position, quaternion: [0, 0, 0, 1] } });
  setRequest(request);
}

/** The point [x, y] of the plane z = 0 under the pointer; null beside it. */
function onFloor(event) {
  const area = view.renderer.domElement.getBoundingClientRect();
  const ray = new THREE.Raycaster();
  ray.setFromCamera(new THREE.Vector2((2 * (event.clientX - area.left)) / area.width - 1, 1 - (2 * (event.clientY - area.top)) / area.height), view.camera);
  const hit = ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Vector3());
  return hit && hit.length() < 5 ? [hit.x, hit.y] : null;
}
