// From where the picture is seen, and what fades because it stands in front of the arm.
import * as THREE from "three";
import type { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { multiply, ofPose, positionOf, type Chain, type Matrix } from "../store/chain";
import type { Pose } from "../store/types";

// from where the views look: the first one is chosen so that as little as possible hides the arm
const VIEWS: Record<number, [number, number, number]> = {
  0: [0.3, -0.75, 0.95], // of a map on the floor
  2: [0, -1, 0.12],
  3: [1, 0, 0.12],
  4: [-1, 0, 0.12],
  5: [0, 1, 0.12],
  6: [0.001, -0.001, 1],
};
const FADED = 0.13;

/** A solid of the scene with its single material. */
export interface Solid {
  material: THREE.MeshLambertMaterial;
  solid: boolean;
  hides: boolean;
  name: string;
  title: string;
}

export const solidOf = (object: THREE.Object3D) => object.userData as Solid;

export class Eye {
  private readonly ray = new THREE.Raycaster();
  private middle: THREE.Vector3 | null = null;
  private bounds = new THREE.Box3();
  private postures: Matrix[][] = [];
  private tcp: Partial<Pose> | undefined;

  constructor(
    private readonly camera: THREE.PerspectiveCamera,
    private readonly controls: OrbitControls,
    private readonly obstacles: THREE.Group,
  ) {}

  /**
   * What stands between the eye and the arm becomes faint, and so does what does not count, by
   * name.
   */
  fade(frames: Matrix[], ignored: string[], on: boolean, moving: boolean): void {
    const hiding = new Set(
      this.obstacles.children.filter((each) => ignored.includes(solidOf(each).name)),
    );
    if (on)
      for (const T of [...frames.slice(2), multiply(frames.at(-1)!, ofPose(this.tcp))])
        for (const object of this.hiders(this.camera.position, T)) hiding.add(object);
    for (const object of this.obstacles.children) {
      const { material } = solidOf(object);
      const aim = hiding.has(object) ? FADED : 1;
      if (material.opacity === aim) continue;
      const step = moving ? 0.35 : 1;
      material.opacity +=
        Math.abs(aim - material.opacity) < 0.02
          ? aim - material.opacity
          : step * (aim - material.opacity);
      // what is not faint is drawn from front to back, and nothing is blended: that costs a slow
      // machine least
      material.transparent = material.opacity < 1;
      material.depthWrite = material.opacity > 0.6;
    }
  }

  /** Light, controls and distance for postures of an arm. */
  fit(
    samples: number[][],
    chain: Chain,
    tcp: Partial<Pose> | undefined,
    sun: THREE.DirectionalLight,
  ): void {
    this.tcp = tcp;
    this.postures = samples.map((q) => chain.frames(q));
    const box = new THREE.Box3(new THREE.Vector3(-0.2, -0.2, 0), new THREE.Vector3(0.2, 0.2, 0.4));
    for (const frames of this.postures)
      for (const T of frames) box.expandByPoint(new THREE.Vector3(...positionOf(T)));
    box.expandByScalar(0.1);
    const arm = box.getBoundingSphere(new THREE.Sphere()).radius;
    for (const object of this.obstacles.children) {
      if (!solidOf(object).solid) continue;
      object.updateWorldMatrix(true, true);
      const part = new THREE.Box3().setFromObject(object);
      if (part.getSize(new THREE.Vector3()).length() < 4 * arm && !part.isEmpty()) box.union(part);
    }
    this.bounds = box;
    const { center, radius } = box.getBoundingSphere(new THREE.Sphere());
    this.middle = center;
    sun.position.copy(center).add(new THREE.Vector3(1.1, -0.7, 2.4).multiplyScalar(radius));
    sun.target.position.copy(center);
    const wide = 1.25 * radius;
    Object.assign(sun.shadow.camera, {
      left: -wide,
      right: wide,
      bottom: -wide,
      top: wide,
      near: 0.1,
      far: 6 * radius,
    });
    sun.shadow.camera.updateProjectionMatrix();
  }

  /** Widens what all views hold by an object. */
  hold(object: THREE.Object3D): void {
    object.updateWorldMatrix(true, true);
    this.bounds.union(new THREE.Box3().setFromObject(object));
    this.middle = this.bounds.getCenter(new THREE.Vector3());
  }

  /** One of the views, by its number. */
  look(number: number): void {
    if (!this.middle) return;
    const view = VIEWS[number];
    const from = view ? new THREE.Vector3(...view).normalize() : this.clearest();
    this.controls.target.copy(this.middle);
    this.camera.position.copy(this.seeing(from, this.middle));
    this.controls.update();
  }

  /** Where the eye is, to see all of the box from a direction. */
  private seeing(from: THREE.Vector3, middle: THREE.Vector3): THREE.Vector3 {
    this.camera.position.copy(middle).add(from);
    this.camera.lookAt(middle);
    this.camera.updateMatrixWorld();
    const across = Math.tan((this.camera.fov * Math.PI) / 360);
    const back = new THREE.Quaternion().copy(this.camera.quaternion).invert();
    const { min, max } = this.bounds;
    let distance = 0.3;
    for (const x of [min.x, max.x])
      for (const y of [min.y, max.y])
        for (const z of [min.z, max.z]) {
          const corner = new THREE.Vector3(x, y, z).sub(middle).applyQuaternion(back);
          distance = Math.max(
            distance,
            corner.z +
              Math.max(Math.abs(corner.y), Math.abs(corner.x) / this.camera.aspect) / across,
          );
        }
    return from
      .clone()
      .multiplyScalar(1.02 * distance)
      .add(middle);
  }

  /**
   * The direction around the arm from which obstacles hide least of its motion, and which the
   * motion faces.
   */
  private clearest(): THREE.Vector3 {
    const few = this.postures.filter(
      (_, k, all) => k % Math.max(1, Math.floor(all.length / 5)) === 0,
    );
    const tcps = few.map((frames) => multiply(frames.at(-1)!, ofPose(this.tcp)));
    const points = [...few.flatMap((frames) => frames.slice(3)), ...tcps];
    this.obstacles.updateMatrixWorld(true);
    const sum = (row: number) => tcps.reduce((all, T) => all + T[row]!, 0);
    const outward = Math.atan2(sum(7), sum(3));
    let best = { from: new THREE.Vector3(1, 0, 0.5), hidden: Infinity };
    for (let k = 0; k < 12; k++) {
      const angle = outward + 0.6 + (k * Math.PI) / 6;
      const from = new THREE.Vector3(Math.cos(angle), Math.sin(angle), 0.5).normalize();
      const eye = this.seeing(from, this.middle!);
      const hidden =
        points.filter((T) => this.hiders(eye, T).length > 0).length -
        0.2 * points.length * Math.cos(angle - outward);
      if (hidden < best.hidden) best = { from, hidden };
    }
    return best.from;
  }

  /** The ray through the pointer. */
  aim({ offsetX, offsetY, target }: PointerEvent): THREE.Raycaster {
    const { clientWidth, clientHeight } = target as HTMLElement;
    this.ray.setFromCamera(
      new THREE.Vector2((2 * offsetX) / clientWidth - 1, 1 - (2 * offsetY) / clientHeight),
      this.camera,
    );
    this.ray.far = Infinity;
    return this.ray;
  }

  /** The obstacle under the pointer; null if there is none. */
  under(event: PointerEvent): { object: THREE.Object3D; at: number[] } | null {
    const all = this.obstacles.children.filter((each) => solidOf(each).hides);
    const [hit] = this.aim(event).intersectObjects(all, true);
    const object = hit && all.find((each) => each.getObjectById(hit.object.id));
    return object ? { object, at: hit.point.toArray() } : null;
  }

  /** The obstacles between an eye and the origin of a frame. */
  private hiders(eye: THREE.Vector3, T: Matrix): THREE.Object3D[] {
    const to = new THREE.Vector3(...positionOf(T));
    this.ray.set(eye, to.clone().sub(eye).normalize());
    this.ray.far = to.distanceTo(eye) - 0.03;
    return this.obstacles.children.filter(
      (object) => solidOf(object).hides && this.ray.intersectObject(object, true).length,
    );
  }
}
