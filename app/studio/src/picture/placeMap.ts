// The map of a placement on the floor: energies as colours, marks where the arm cannot work. A click
// puts the base there.
import { effect, untracked } from "@preact/signals";
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { inverse } from "../store/chain";
import { bestPose, layer, look, mapShown, type Mapped } from "../store/placement";
import { columnsOf, coordinatesOf, energiesOf, pitchOf, placeName } from "../store/places";
import type { Place, Reason } from "../store/places";
import { placing, toast } from "../store/state";
import { figure } from "../store/units";
import { dark } from "../ui/dark";
import { empty } from "./content";
import { rampAt } from "./path";
import { place } from "./shapes";
import { colour } from "./theme";
import type { View } from "./view";

const ABOVE = 0.004; // of the floor, so that both are told apart [m]
const CLICK = 4; // way of the pointer up to which a press is a click [px]
const OVERVIEW = 0;

const strip = (turn: number) => new THREE.PlaneGeometry(1.3, 0.22).rotateZ(turn);
const outline = (corners: number, turn: number) =>
  new THREE.RingGeometry(0.52, 0.78, corners).rotateZ(turn);

/** Marks of places without an energy, as wide as half a place is 1. */
const MARKS: Record<Reason | "none", () => THREE.BufferGeometry> = {
  reach: () => mergeGeometries([strip(Math.PI / 4), strip(-Math.PI / 4)]),
  collision: () => outline(4, Math.PI / 4),
  torque: () => outline(3, -Math.PI / 2),
  time: () => outline(3, Math.PI / 2),
  motion: () => mergeGeometries([strip(0), strip(Math.PI / 2)]),
  none: () => new THREE.CircleGeometry(0.25, 12),
};

export class PlaceMap {
  private columns: Place[] = [];
  private half: [number, number] = [0, 0];
  private shown: Mapped | null = null;
  private pressed: [number, number] | null = null;

  constructor(private readonly view: View) {
    effect(() => {
      void [mapShown.value, layer.value, dark.value];
      untracked(() => this.build());
    });
    const canvas = view.renderer.domElement;
    canvas.addEventListener("pointermove", (event) => event.buttons || this.hover(event));
    canvas.addEventListener("pointerleave", () => this.hover(null));
    // while a handle is held, the view does not turn
    canvas.addEventListener("pointerdown", ({ offsetX, offsetY }) => {
      this.pressed = view.controls.enabled ? [offsetX, offsetY] : null;
    });
    canvas.addEventListener("pointerup", (event) => {
      const [x, y] = this.pressed ?? [-Infinity, 0];
      if (Math.hypot(event.offsetX - x, event.offsetY - y) > CLICK) return;
      const column = this.under(event);
      if (column) look(column.pose).catch((error: Error) => (toast.value = error.message));
    });
  }

  private get group(): THREE.Group {
    return this.view.parts.places;
  }

  private build(): void {
    const map = mapShown.value;
    empty(this.group);
    this.columns = map ? columnsOf(map.places, layer.value) : [];
    const energies = energiesOf(this.columns);
    if (map) {
      place(this.group, inverse(map.world));
      this.half = pitchOf(this.columns).map((pitch) => pitch / 2) as [number, number];
      if (energies) this.tiles(energies);
      for (const reason of Object.keys(MARKS) as (Reason | "none")[]) this.fail(reason);
    }
    this.ends(map);
    if (map && map !== this.shown) {
      this.view.eye.hold(this.group);
      this.view.look(OVERVIEW);
    }
    // the cell is drawn anew first
    if (this.shown && !placing.value) queueMicrotask(() => this.view.look(1));
    this.shown = map;
    this.view.draw();
  }

  /** The height at which the map lies in the world [m]. */
  private get height(): number {
    return (layer.value.height ?? 0) + ABOVE;
  }

  private tiles([least, most]: [number, number]): void {
    const solved = this.columns.filter(({ energy }) => energy !== null);
    const [x, y] = this.half;
    const mesh = this.many(new THREE.PlaneGeometry(1.9 * x, 1.9 * y), solved, 0xffffff);
    solved.forEach(({ energy }, k) =>
      mesh.setColorAt(k, rampAt((energy! - least) / (most - least || 1))),
    );
  }

  private fail(reason: Reason | "none"): void {
    const failed = this.columns.filter(
      (each) => each.energy === null && (each.reason ?? "none") === reason,
    );
    const size = 0.55 * Math.min(...this.half);
    if (failed.length) this.many(MARKS[reason]().scale(size, size, 1), failed, colour("--ink-2"));
  }

  /** A flat shape at several places. */
  private many(shape: THREE.BufferGeometry, at: Place[], tint: number): THREE.InstancedMesh {
    const side = THREE.DoubleSide; // under the ceiling it is seen from below
    const material = new THREE.MeshBasicMaterial({ color: tint, side });
    const mesh = new THREE.InstancedMesh(shape, material, at.length);
    const T = new THREE.Matrix4();
    at.forEach(({ at: [x, y] }, k) => mesh.setMatrixAt(k, T.makeTranslation(x, y, this.height)));
    this.group.add(mesh);
    return mesh;
  }

  /** The best place and that of now, with their joules. */
  private ends(map: Mapped | null): void {
    const ends = {
      best: map && { at: coordinatesOf(bestPose(map), map.world).at, of: map.answer.best },
      now: map && { at: [0, 0, 0] as [number, number, number], of: map.answer.nominal },
    };
    for (const [name, end] of Object.entries(ends)) {
      if (!map || !end) {
        this.view.labels.drop(`place ${name}`);
        continue;
      }
      const size = Math.min(...this.half);
      const shape =
        name === "best" ? new THREE.CircleGeometry(0.5, 4) : new THREE.RingGeometry(0.4, 0.6, 24);
      const mesh = this.many(
        shape.scale(size, size, 1).translate(0, 0, ABOVE / 2),
        [{ at: end.at } as Place],
        colour(name === "best" ? "--goal" : "--start"),
      );
      mesh.renderOrder = 1;
      const energy = end.of ? `${figure(end.of.energy)} J` : "not feasible";
      const [x, y] = end.at;
      this.view.labels.put(`place ${name}`, `${name}: ${energy}`, this.seen(x, y), "place");
    }
  }

  /** A point of the map in the picture. */
  private seen(x: number, y: number): number[] {
    this.group.updateMatrixWorld();
    return new THREE.Vector3(x, y, this.height).applyMatrix4(this.group.matrixWorld).toArray();
  }

  private hover(event: PointerEvent | null): void {
    const column = event && this.under(event);
    if (column) {
      const [x, y] = column.at;
      this.view.labels.put("place hover", placeName(column), this.seen(x, y), "place");
    } else this.view.labels.drop("place hover");
    if (this.columns.length) this.view.draw(true);
  }

  /** The place of the map under the pointer; null behind an obstacle, and beside the map. */
  private under(event: PointerEvent): Place | null {
    if (!this.columns.length || this.view.eye.under(event)) return null;
    this.group.updateMatrixWorld();
    const back = this.group.matrixWorld.clone().invert();
    const ray = this.view.eye.aim(event).ray.clone().applyMatrix4(back);
    const floor = new THREE.Plane(new THREE.Vector3(0, 0, 1), -this.height);
    const hit = ray.intersectPlane(floor, new THREE.Vector3());
    const [x, y] = this.half;
    return (
      this.columns.find(
        ({ at }) => hit && Math.abs(at[0] - hit.x) < x && Math.abs(at[1] - hit.y) < y,
      ) ?? null
    );
  }
}
