// From where the picture is seen, and what fades because it stands in front of the arm.
import * as THREE from "three";
import { multiply, ofPose, sampleAt } from "./chain.js";
import { state } from "./store.js";

// from where the views look: the first one is chosen so that as little as possible hides the arm
const VIEWS = { 2: [0, -1, 0.12], 3: [1, 0, 0.12], 4: [-1, 0, 0.12], 5: [0, 1, 0.12], 6: [0.001, -0.001, 1] };
const FADED = 0.13;

export class Eye {
  constructor(camera, controls, obstacles) {
    Object.assign(this, { camera, controls, obstacles });
    this.ray = new THREE.Raycaster();
  }

  /** What stands between the eye and the arm becomes faint, and so does what does not count, by name. */
  fade(frames, ignored) {
    const hiding = new Set(this.obstacles.children.filter(({ userData }) => ignored.includes(userData.name)));
    if (state.show.fade)
      for (const T of [...frames.slice(2), multiply(frames.at(-1), ofPose(state.cell.tcp))])
        for (const object of this.hiders(this.camera.position, T)) hiding.add(object);
    for (const object of this.obstacles.children) {
      const { material } = object.userData;
      const aim = hiding.has(object) ? FADED : 1;
      if (material.opacity === aim) continue;
      const step = state.playing ? 0.35 : 1;
      material.opacity += Math.abs(aim - material.opacity) < 0.02 ? aim - material.opacity : step * (aim - material.opacity);
      // what is not faint is drawn from front to back, and nothing is blended: that costs a slow machine least
      material.transparent = material.opacity < 1;
      material.depthWrite = material.opacity > 0.6;
    }
  }

  /** Light, controls and distance for all that is shown. */
  fit(trajectory, chain, sun) {
    Object.assign(this, { trajectory, chain });
    const box = new THREE.Box3(new THREE.Vector3(-0.2, -0.2, 0), new THREE.Vector3(0.2, 0.2, 0.4));
    const { t, q } = trajectory;
    for (let k = 0; k < 24; k++)
      for (const T of this.chain.frames(sampleAt(t, q, (t.at(-1) * k) / 23))) box.expandByPoint(new THREE.Vector3(T[3], T[7], T[11]));
    box.expandByScalar(0.1);
    const arm = box.getBoundingSphere(new THREE.Sphere()).radius;
    for (const object of this.obstacles.children) {
      if (!object.userData.solid) continue;
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
    Object.assign(sun.shadow.camera, { left: -wide, right: wide, bottom: -wide, top: wide, near: 0.1, far: 6 * radius });
    sun.shadow.camera.updateProjectionMatrix();
  }

  /** One of the six views, by its number. */
  look(number) {
    if (!this.middle) return;
    const from = VIEWS[number] ? new THREE.Vector3(...VIEWS[number]).normalize() : this.clearest();
    this.controls.target.copy(this.middle);
    this.camera.position.copy(this.seeing(from));
    this.controls.update();
  }

  /** Where the eye is, to see all of the box from a direction. */
  seeing(from) {
    this.camera.position.copy(this.middle).add(from);
    this.camera.lookAt(this.middle);
    this.camera.updateMatrixWorld();
    const across = Math.tan((this.camera.fov * Math.PI) / 360);
    const back = new THREE.Quaternion().copy(this.camera.quaternion).invert();
    const { min, max } = this.bounds;
    let distance = 0.3;
    for (const x of [min.x, max.x]) for (const y of [min.y, max.y]) for (const z of [min.z, max.z]) {
      const corner = new THREE.Vector3(x, y, z).sub(this.middle).applyQuaternion(back);
      distance = Math.max(distance, corner.z + Math.max(Math.abs(corner.y), Math.abs(corner.x) / this.camera.aspect) / across);
    }
    return from.clone().multiplyScalar(1.02 * distance).add(this.middle);
  }

  /** The direction around the arm from which obstacles hide least of its motion, and which the motion faces. */
  clearest() {
    const { t, q } = this.trajectory;
    const points = [0, 0.25, 0.5, 0.75, 1].flatMap((share) => {
      const frames = this.chain.frames(sampleAt(t, q, share * t.at(-1)));
      return [...frames.slice(3), multiply(frames.at(-1), ofPose(state.cell.tcp))];
    });
    this.obstacles.updateMatrixWorld(true);
    const tcps = points.filter((_, k) => (k + 1) % (points.length / 5) === 0);
    const outward = Math.atan2(...[7, 3].map((row) => tcps.reduce((sum, T) => sum + T[row], 0)));
    let best = null;
    for (let k = 0; k < 12; k++) {
      const angle = outward + 0.6 + (k * Math.PI) / 6;
      const from = new THREE.Vector3(Math.cos(angle), Math.sin(angle), 0.5).normalize();
      const eye = this.seeing(from);
      const hidden = points.filter((T) => this.hiders(eye, T).length > 0).length - 0.2 * points.length * Math.cos(angle - outward);
      if (!best || hidden < best.hidden) best = { from, hidden };
    }
    return best.from;
  }

  /** The ray through the pointer. */
  aim({ offsetX, offsetY, target }) {
    this.ray.setFromCamera(new THREE.Vector2((2 * offsetX) / target.clientWidth - 1, 1 - (2 * offsetY) / target.clientHeight), this.camera);
    this.ray.far = Infinity;
    return this.ray;
  }

  /** The obstacle {object, at} under the pointer; null if there is none. */
  under(event) {
    const all = this.obstacles.children.filter(({ userData }) => userData.hides);
    const [hit] = this.aim(event).intersectObjects(all, true);
    return hit ? { object: all.find((each) => each.getObjectById(hit.object.id)), at: hit.point.toArray() } : null;
  }

  /** The obstacles between an eye and the origin of a frame. */
  hiders(eye, T) {
    const to = new THREE.Vector3(T[3], T[7], T[11]);
    this.ray.set(eye, to.clone().sub(eye).normalize());
    this.ray.far = to.distanceTo(eye) - 0.03;
    return this.obstacles.children.filter((object) => object.userData.hides && this.ray.intersectObject(object, true).length);
  }
}
