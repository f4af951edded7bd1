// Words at points of the picture.
import * as THREE from "three";

interface Label {
  node: HTMLElement;
  at: THREE.Vector3;
  /** How far below its point it stands [px]. */
  below: number;
  still: boolean;
}

const BELOW: Record<string, number> = { near: -22, stop: 20, end: -38, hover: -20, place: -16 };
const STILL = ["hover", "place"]; // kinds whose points do not move with the base

export class Labels {
  /** Pose of the base, in whose frame the points of the arm are. */
  readonly base = new THREE.Matrix4();
  private readonly all = new Map<string, Label>();

  constructor(
    private readonly layer: HTMLElement,
    private readonly camera: THREE.Camera,
  ) {}

  /** A label by its name: its text, the point [x, y, z] it belongs to, and its kind. */
  put(name: string, text: string, at: number[], kind: string): void {
    let label = this.all.get(name);
    if (!label) {
      const node = document.createElement("span");
      node.className = `label ${kind}`;
      this.layer.append(node);
      const first = kind.split(" ")[0]!;
      const below = BELOW[first] ?? 0;
      label = { node, at: new THREE.Vector3(), below, still: STILL.includes(first) };
      this.all.set(name, label);
    }
    label.at.fromArray(at);
    if (label.node.textContent !== text) label.node.textContent = text;
  }

  drop(name: string): void {
    this.all.get(name)?.node.remove();
    this.all.delete(name);
  }

  /** Drops labels `kind k` with k at or above `count`. */
  keep(kind: string, count: number): void {
    for (const name of [...this.all.keys()])
      if (name.startsWith(`${kind} `) && Number(name.slice(kind.length + 1)) >= count)
        this.drop(name);
  }

  /**
   * Puts every label where its point is seen; of those that would cover each other, later ones move
   * down.
   */
  place({ width, height }: { width: number; height: number }): void {
    const taken: { left: number; right: number; top: number; bottom: number }[] = [];
    for (const { node, at, below, still } of this.all.values()) {
      const point = at.clone();
      if (!still) point.applyMatrix4(this.base);
      point.project(this.camera);
      node.hidden = Math.max(Math.abs(point.x), Math.abs(point.y), point.z) > 1;
      if (node.hidden) continue;
      // the words stay inside, where their point is
      const [half, tall] = [node.offsetWidth / 2, node.offsetHeight];
      const x = Math.max(half, Math.min(width - half, ((point.x + 1) * width) / 2));
      let y = ((1 - point.y) * height) / 2 + below;
      const meets = () =>
        taken.find(
          (box) =>
            x - half < box.right &&
            x + half > box.left &&
            y - tall / 2 < box.bottom &&
            y + tall / 2 > box.top,
        );
      for (let box = meets(), tries = 0; box && tries < 12; box = meets(), tries++)
        y = box.bottom + tall / 2 + 1;
      taken.push({ left: x - half, right: x + half, top: y - tall / 2, bottom: y + tall / 2 });
      node.style.transform = `translate(-50%, -50%) translate(${x}px, ${y}px)`;
    }
  }
}
