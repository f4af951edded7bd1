// The renderer: camera, light, fineness. It draws only when something changed.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { playing, show } from "../store/state";
import { Content } from "./content";
import { Eye, solidOf } from "./eye";
import { Labels } from "./labels";
import { PARTS, type Parts } from "./parts";

// time of a frame [s] above which the picture gets coarser while it moves, and below which finer
// again
const SLOW = 0.055;
const FAST = 0.022;
// pixels along an edge of a pixel of the page, of a still picture: its edges are smooth by that
// alone
const STILL = 2;
const PAUSE = 400; // until then a picture does not count as still [ms]
const AXIS = 0.22; // length of an arrow of the base frame [m]
const AXES: [number, number, number, number][] = [
  [1, 0, 0, 0xd64545],
  [0, 1, 0, 0x2f9e58],
  [0, 0, 1, 0x3b6fd8],
];

export class View {
  readonly renderer = new THREE.WebGLRenderer({ antialias: false, alpha: true });
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(32, 1, 0.02, 60);
  readonly controls: OrbitControls;
  readonly parts: Parts;
  readonly labels: Labels;
  readonly eye: Eye;
  readonly sun = new THREE.DirectionalLight(0xffffff, 2.1);
  readonly content: Content;
  /** Frames that were drawn. */
  frames = 0;
  private fineness = 1;
  private coarse = 1;
  private pace = (SLOW + FAST) / 2;
  private waiting = false;
  private last: number | null = null;
  private refining: ReturnType<typeof setTimeout> | undefined;
  private over = "";
  private turned = false;
  private shown = "";
  private size = { width: 1, height: 1 };

  constructor(
    private readonly box: HTMLElement,
    layer: HTMLElement,
  ) {
    // softer shadows cost a machine without a graphics card a third of its frames
    Object.assign(this.renderer.shadowMap, {
      enabled: true,
      type: THREE.BasicShadowMap,
      autoUpdate: false,
    });
    box.prepend(this.renderer.domElement);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw(true));
    this.controls.addEventListener("start", () => (this.turned = true));
    this.parts = Object.fromEntries(PARTS.map((name) => [name, new THREE.Group()])) as Parts;
    this.scene.add(...Object.values(this.parts));
    this.labels = new Labels(layer, this.camera);
    this.eye = new Eye(this.camera, this.controls, this.parts.obstacles);
    this.content = new Content(this.parts, this.labels, () => this.draw());
    this.light();
    this.axes();
    const canvas = this.renderer.domElement;
    canvas.addEventListener("pointermove", (event) => event.buttons || this.hover(event));
    for (const name of ["pointerdown", "pointerleave"] as const)
      canvas.addEventListener(name, () => this.hover(null));
    new ResizeObserver(() => this.resize()).observe(box);
    this.resize();
  }

  /** The arms that are drawn. */
  get arms() {
    return this.content.arms;
  }

  get chain() {
    return this.content.chain;
  }

  private light(): void {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8d99a8, 1.9));
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    Object.assign(this.sun.shadow, { bias: -0.0003, normalBias: 0.004 });
    this.scene.add(this.sun, this.sun.target);
  }

  private axes(): void {
    AXES.forEach(([x, y, z, colour], axis) => {
      const direction = new THREE.Vector3(x, y, z);
      this.parts.axes.add(
        new THREE.ArrowHelper(direction, new THREE.Vector3(), AXIS, colour, 0.035, 0.02),
      );
      this.labels.put(
        `axis ${axis}`,
        "xyz"[axis]!,
        [x, y, z].map((part) => part * (AXIS + 0.02)),
        "axis",
      );
    });
  }

  /** Everything anew; a view that was chosen by hand stays, as long as the arm is the same. */
  build(): void {
    const built = this.content.build();
    if (!built) return;
    if (!built.looks) this.eye.fit(built.samples, built.chain, built.tcp, this.sun);
    if (this.shown !== built.robot || (!this.turned && built.moves && !built.looks)) this.look(1);
    this.shown = built.robot;
    this.pose();
  }

  /** The arms at the present time. */
  pose(): void {
    this.content.pose();
    this.draw();
  }

  /** The obstacle under the pointer has its name, and its margin as a shell. */
  private hover(event: PointerEvent | null): void {
    const found = event && this.eye.under(event);
    const over = found ? solidOf(found.object).title : "";
    this.labels.drop("hover");
    if (found && over) this.labels.put("hover", over, found.at, "hover");
    if (over || this.over) {
      this.content.showMargins(found?.object ?? null);
      this.draw();
    }
    this.over = over;
  }

  /**
   * Draws once, at the next frame of the browser. The shadows are as before if nothing moved but
   * the eye.
   */
  draw(onlyEye = false): void {
    if (!onlyEye) this.renderer.shadowMap.needsUpdate = true;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.render();
    });
  }

  /** Draws now. When nothing has changed for a while, once more, `fine`. */
  render(fine = false): void {
    const now = performance.now();
    if (fine) this.setFineness(STILL);
    else this.adapt(now);
    this.controls.update();
    const { frames, ignored } = this.content;
    if (frames.length) this.eye.fade(frames, ignored, show.value.fade, playing.value);
    this.renderer.render(this.scene, this.camera);
    this.labels.place(this.size);
    this.frames += 1;
    this.last = now;
    clearTimeout(this.refining);
    if (!fine) this.refining = setTimeout(() => this.render(true), PAUSE);
  }

  /**
   * Coarser while frames come slowly, finer when they come fast. A still picture is always fine.
   */
  private adapt(now: number): void {
    const took = (now - (this.last ?? now)) / 1000;
    if (this.fineness === this.coarse && took < 0.5) this.pace = 0.8 * this.pace + 0.2 * took;
    const step =
      this.pace > SLOW && this.coarse > 0.5
        ? -0.25
        : this.pace < FAST && this.coarse < STILL
          ? 0.25
          : 0;
    if (step) this.pace = (SLOW + FAST) / 2;
    this.coarse += step;
    this.setFineness(this.coarse);
  }

  setFineness(fineness: number): void {
    if (this.fineness === fineness) return;
    this.fineness = fineness;
    // without a graphics card, shadows take half the time of a coarse picture
    this.sun.castShadow = fineness >= 1;
    this.renderer.setPixelRatio(fineness);
  }

  /** One of the six views, by its number. */
  look(number: number): void {
    this.eye.look(number);
    this.turned = number !== 1;
    this.draw();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (!width || !height) return;
    this.size = { width, height };
    this.renderer.setPixelRatio(this.fineness);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    // the whole cell stays in view, unless a view was chosen by hand
    if (this.shown && !this.turned) this.look(1);
    this.draw();
  }

  /** The picture as a PNG. */
  picture(): Promise<Blob | null> {
    this.setFineness(STILL);
    this.renderer.render(this.scene, this.camera);
    return new Promise((resolve) => this.renderer.domElement.toBlob(resolve));
  }
}
