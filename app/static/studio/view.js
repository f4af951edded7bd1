// The picture: arms, ghosts, obstacles, the path of the TCP, the nearest pair. It draws only when something changed.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Arm } from "./arm.js";
import { Chain, cellOf, multiply, ofPose, sampleAt } from "./chain.js";
import { $, el, figure, style } from "./dom.js";
import { Eye } from "./eye.js";
import { Labels } from "./labels.js";
import { pathOfPower, rampStops } from "./path.js";
import { kindOf } from "./request.js";
import { legAt } from "./cycle.js";
import { placedShape } from "./shapes.js";
import { follow, state } from "./store.js";

const START = 0x3b7dd8;
const GOAL = 0xe07b39;
// margin of an obstacle without one in the request [m]: the default of the service
const DEFAULT_MARGIN = 0.005;
// time of a frame [s] above which the picture gets coarser while it moves, and below which finer again
const SLOW = 0.055;
const FAST = 0.022;
// pixels along an edge of a pixel of the page, of a still picture: its edges are smooth by that alone
const STILL = 2;
const NEAR = 0.5; // of a cycle, for which the nearest pair is shown before and after its instant [s]
const PAUSE = 400; // until then a picture does not count as still [ms]

let view = null;

/** The picture, or null without WebGL. */
export function createView() {
  if (!document.createElement("canvas").getContext("webgl2")) {
    $("no-view").hidden = false;
    return null;
  }
  view = new View($("view"));
  follow("answer arms", () => view.build());
  follow("request", () => view.preview());
  follow("chosen best", () => view.buildGhosts());
  follow("time show", () => view.pose());
  follow("playing", () => view.draw(true));
  return view;
}

class View {
  constructor(box) {
    this.box = box;
    this.renderer = new THREE.WebGLRenderer({ antialias: false, alpha: true });
    // softer shadows cost a machine without a graphics card a third of its frames
    Object.assign(this.renderer.shadowMap, { enabled: true, type: THREE.BasicShadowMap, autoUpdate: false });
    box.prepend(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.02, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw(true));
    this.controls.addEventListener("start", () => { this.turned = true; });
    this.parts = Object.fromEntries(["arms", "ghosts", "obstacles", "margins", "path", "nearest", "axes"].map((name) => {
      const group = new THREE.Group();
      this.scene.add(group);
      return [name, group];
    }));
    this.labels = new Labels($("labels"), this.camera);
    this.eye = new Eye(this.camera, this.controls, this.parts.obstacles);
    this.fineness = this.coarse = 1;
    this.pace = (SLOW + FAST) / 2;
    this.light();
    this.axes();
    this.renderer.domElement.addEventListener("pointermove", (event) => event.buttons || this.hover(event));
    for (const name of ["pointerdown", "pointerleave"]) this.renderer.domElement.addEventListener(name, () => this.hover(null));
    new ResizeObserver(() => this.resize()).observe(box);
    this.resize();
  }

  light() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8d99a8, 1.9));
    this.sun = new THREE.DirectionalLight(0xffffff, 2.1);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    Object.assign(this.sun.shadow, { bias: -0.0003, normalBias: 0.004 });
    this.scene.add(this.sun, this.sun.target);
  }

  axes() {
    const length = 0.22;
    [[1, 0, 0, 0xd64545], [0, 1, 0, 0x2f9e58], [0, 0, 1, 0x3b6fd8]].forEach(([x, y, z, colour], axis) => {
      const arrow = new THREE.ArrowHelper(new THREE.Vector3(x, y, z), new THREE.Vector3(), length, colour, 0.035, 0.02);
      this.parts.axes.add(arrow);
      this.labels.put(`axis ${axis}`, "xyz"[axis], [x, y, z].map((part) => part * (length + 0.02)), "axis");
    });
  }

  /** Everything anew: another answer, or other arms beside it. */
  build() {
    const { answer, cell, robot, arms, cycle } = state;
    if (!answer) return;
    this.chain = new Chain(robot);
    for (const name of ["arms", "path"]) this.empty(this.parts[name]);
    this.arms = arms.map(({ answer: own, colour }, k) => {
      const arm = new Arm(this.chain, robot, cell, { ...(k ? { tint: colour } : {}), loads: cycle?.loads.map(({ payload }) => payload) });
      this.parts.arms.add(arm.object);
      this.parts.path.add(pathOfPower(own.trajectory, (q) => this.chain.tcp(q, cell.tcp), k ? 0.006 : 0.009));
      return arm;
    });
    this.drawScene(cell.scene);
    this.nearest = this.nearestOf(answer);
    this.eye.fit(state.answer.trajectory, this.chain, this.sun);
    this.explain();
    this.nameStops(cycle);
    this.buildGhosts();
    // a view that was chosen by hand stays, as long as the arm is the same
    if (this.shown !== answer.robot || !this.turned) this.look(1);
    this.shown = answer.robot;
    this.pose();
  }

  /** The stops of a cycle, by their names. */
  nameStops(cycle) {
    const places = new Map(); // several stops may be at one of them
    for (const [name, q] of new Map(cycle?.legs.flatMap(({ passes, goal }) => [...(passes ?? []), goal].map(({ stop, q }) => [stop, q])))) {
      const T = this.chain.tcp(q, state.cell.tcp);
      const at = [T[3], T[7], T[11]].map((value) => value.toFixed(3)).join();
      if (!name.includes("/")) places.set(at, [...(places.get(at) ?? []), name]);
    }
    [...places].forEach(([at, names], k) => this.labels.put(`stop ${k}`, names.join(", "), at.split(",").map(Number), "stop"));
    this.labels.keep("stop", places.size);
  }

  /** What the colours of the path mean, and what the axes are. */
  explain() {
    const { power } = state.answer.trajectory;
    const ramp = el("i");
    ramp.style.background = `linear-gradient(90deg, ${rampStops})`;
    $("legend").replaceChildren("power along the path", ramp, el("div", {}, el("span", {}, `${figure(Math.min(...power))} W`), el("span", {}, `${figure(Math.max(...power))} W`)));
    const pendant = state.robot.title.startsWith("Universal Robots");
    $("frame-note").textContent = pendant ? "base frame as on the teach pendant; ROS base_link is turned by 180° about z" : "base frame of the robot";
  }

  /** Obstacles of a request that is being edited, before it is sent. */
  preview() {
    const { request, robot, cell, answer } = state;
    if (!answer || !request || !kindOf(request).drawn || (request.robot ?? "ur5e") !== answer.robot) return;
    try {
      const edited = cellOf(request, robot);
      if (JSON.stringify(edited.scene) === JSON.stringify(this.drawnScene ?? cell.scene)) return;
      this.drawScene(edited.scene);
    } catch {
      // what is wrong with it, the service says
      this.drawScene(cell.scene);
    }
    this.draw();
  }

  drawScene(scene) {
    this.drawnScene = scene;
    for (const name of ["obstacles", "margins"]) this.empty(this.parts[name]);
    for (const obstacle of scene.obstacles) this.obstacle(obstacle);
  }

  obstacle(obstacle) {
    const colour = new THREE.Color(style(obstacle.shape === "half_space" ? "--floor" : "--obstacle"));
    const material = new THREE.MeshLambertMaterial({ color: colour, side: THREE.DoubleSide });
    const object = placedShape(obstacle, material);
    const solid = obstacle.shape !== "half_space";
    // to look for thousands of parts between eye and arm would take longer than to draw them
    const hides = solid && !["points", "voxels", "mesh_file"].includes(obstacle.shape);
    object.userData = { material, solid, hides, name: obstacle.name };
    object.traverse((mesh) => {
      mesh.receiveShadow = true;
      mesh.castShadow = solid;
    });
    object.children[0].addEventListener("filled", () => this.draw());
    this.parts.obstacles.add(object);
    const shell = new THREE.MeshBasicMaterial({ color: 0xd64545, transparent: true, opacity: 0.16, depthWrite: false, side: THREE.DoubleSide });
    const margin = obstacle.margin ?? DEFAULT_MARGIN;
    object.userData.title = `${obstacle.name}, margin ${figure(margin * 1000)} mm`;
    if (margin > 0 && obstacle.shape !== "mesh_file") {
      const around = placedShape(obstacle, shell, margin);
      around.userData.of = object;
      this.parts.margins.add(around);
    }
  }

  /** The obstacle under the pointer has its name, and its margin as a shell. */
  hover(event) {
    const found = event && this.eye.under(event);
    const over = found && found.object.userData.title;
    this.labels.drop("hover");
    if (over) this.labels.put("hover", over, found.at, "hover");
    if (over || this.over) this.showMargins(found?.object);
    this.over = over;
  }

  showMargins(over = null) {
    for (const shell of this.parts.margins.children) shell.visible = state.show.margins || shell.userData.of === over;
    this.draw();
  }

  buildGhosts() {
    this.empty(this.parts.ghosts);
    const { answer, cell, robot, chosen, best, cycle } = state;
    if (!answer) return;
    const ghost = (q, tint, opacity) => {
      const arm = new Arm(this.chain, robot, cell, { tint, opacity });
      arm.pose(q);
      this.parts.ghosts.add(arm.object);
    };
    ghost(answer.trajectory.q[0], START, 0.2);
    // a cycle ends where it begins
    if (!cycle) ghost(answer.trajectory.q.at(-1), GOAL, 0.2);
    chosen.forEach(({ q_goal }, k) => ghost(q_goal, new THREE.Color(style(`--joint-${k + 2}`)).getHex(), 0.42));
    if (best?.q_goal && best.robot === answer.robot) ghost(best.q_goal, new THREE.Color(style("--good")).getHex(), 0.42);
    this.draw();
  }

  /** The line between the nearest points, and its words: that nothing but the distance of this instant is meant. */
  nearestOf({ certificate: { clearance } }) {
    this.empty(this.parts.nearest);
    if (!clearance?.points) return null;
    const ends = clearance.points.map((point) => new THREE.Vector3(...point));
    const material = new THREE.MeshBasicMaterial({ color: 0xd62f6b, depthTest: false, transparent: true });
    for (const end of ends) {
      const dot = new THREE.Mesh(new THREE.SphereGeometry(0.008, 14, 10), material);
      dot.position.copy(end);
      dot.renderOrder = 2;
      this.parts.nearest.add(dot);
    }
    const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends), new THREE.LineBasicMaterial({ color: 0xd62f6b, depthTest: false }));
    this.parts.nearest.add(line);
    const text = `${clearance.pair.join(" – ")}: ${figure(ends[0].distanceTo(ends[1]) * 1000)} mm at ${figure(clearance.time)} s`;
    return { text, at: ends[0].add(ends[1]).multiplyScalar(0.5).toArray() };
  }

  /** The arms at the present time, and what is switched on. */
  pose() {
    if (!this.arms) return;
    const { show, time, arms, cycle, answer } = state;
    const leg = cycle ? legAt(cycle.loads, time) : 0;
    this.ignored = cycle?.loads[leg].ignored ?? [];
    this.arms.forEach((arm, k) => {
      const { t, q } = arms[k].answer.trajectory;
      arm.pose(sampleAt(t, q, time));
      arm.showCapsules(show.capsules);
      arm.carry(leg);
    });
    for (const name of ["ghosts", "path", "axes"]) this.parts[name].visible = show[name];
    $("labels").toggleAttribute("data-without-axes", !show.axes);
    // in a cycle the arm is elsewhere most of the time
    const near = this.nearest && show.nearest && (!cycle || Math.abs(time - answer.certificate.clearance.time) < NEAR);
    this.parts.nearest.visible = Boolean(near);
    if (near) this.labels.put("nearest", this.nearest.text, this.nearest.at, "near");
    else this.labels.drop("nearest");
    this.showMargins();
    this.labels.keep("arm", arms.length > 1 ? arms.length : 0);
    if (arms.length > 1)
      arms.forEach(({ name, answer }, k) => {
        const top = this.arms[k].frames.at(-1);
        this.labels.put(`arm ${k}`, `${name}: ${figure(answer.energy.electrical.total)} J`, [top[3], top[7], top[11] + 0.08 + 0.07 * k], "arm");
      });
    this.draw();
  }

  /** Draws once, at the next frame of the browser. The shadows are as before if nothing moved but the eye. */
  draw(onlyEye = false) {
    if (!onlyEye) this.renderer.shadowMap.needsUpdate = true;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.render();
    });
  }

  /** Draws now. When nothing has changed for a while, once more, `fine`. */
  render(fine = false) {
    const now = performance.now();
    if (fine) this.setFineness(STILL);
    else this.adapt(now);
    this.controls.update();
    if (this.arms) this.eye.fade(this.arms[0].frames, this.ignored);
    this.renderer.render(this.scene, this.camera);
    this.labels.place(this.size);
    this.frames = (this.frames ?? 0) + 1;
    this.last = now;
    clearTimeout(this.refining);
    if (!fine) this.refining = setTimeout(() => this.render(true), PAUSE);
  }

  /** Coarser while frames come slowly, finer when they come fast. A still picture is always fine. */
  adapt(now) {
    const took = (now - (this.last ?? now)) / 1000;
    if (this.fineness === this.coarse && took < 0.5) this.pace = 0.8 * this.pace + 0.2 * took;
    const step = this.pace > SLOW && this.coarse > 0.5 ? -0.25 : this.pace < FAST && this.coarse < STILL ? 0.25 : 0;
    if (step) this.pace = (SLOW + FAST) / 2;
    this.coarse += step;
    this.setFineness(this.coarse);
  }

  setFineness(fineness) {
    if (this.fineness === fineness) return;
    this.fineness = fineness;
    // without a graphics card, shadows take half the time of a coarse picture
    this.sun.castShadow = fineness >= 1;
    this.renderer.setPixelRatio(fineness);
  }

  /** One of the six views, by its number. */
  look(number) {
    this.eye.look(number);
    this.turned = number !== 1;
    this.draw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (!width || !height) return;
    this.size = { width, height };
    this.renderer.setPixelRatio(this.fineness);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  empty(group) {
    // what other arms share is sent to the graphics card again when it is next drawn
    group.traverse((each) => each.geometry?.dispose());
    group.clear();
  }

  /** The picture as a PNG. */
  picture() {
    this.setFineness(STILL);
    this.renderer.render(this.scene, this.camera);
    return new Promise((resolve) => this.renderer.domElement.toBlob(resolve));
  }
}

/** Pose of the TCP as it is drawn now: a matrix, row by row. */
export const drawnTcp = () => multiply(view.arms[0].links.at(-1).matrix.clone().transpose().toArray(), ofPose(state.cell.tcp));
