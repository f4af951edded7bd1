// Words at points of the picture.
import * as THREE from "three";
import { el } from "./dom.js";

export class Labels {
  constructor(layer, camera) {
    Object.assign(this, { layer, camera, all: new Map() });
  }

  /** A label by its name: its text, the point [x, y, z] it belongs to, and its kind. */
  put(name, text, at, kind) {
    if (!this.all.has(name)) {
      const node = el("span", { class: `label ${kind}` });
      this.layer.append(node);
      this.all.set(name, { node });
    }
    const label = Object.assign(this.all.get(name), { at: new THREE.Vector3(...at) });
    if (label.node.textContent !== text) label.node.textContent = text;
  }

  drop(name) {
    this.all.get(name)?.node.remove();
    this.all.delete(name);
  }

  /** Drops labels `kind k` with k at or above `count`. */
  keep(kind, count) {
    for (const name of [...this.all.keys()]) if (name.startsWith(`${kind} `) && Number(name.slice(kind.length + 1)) >= count) this.drop(name);
  }

  place({ width, height }) {
    for (const { node, at } of this.all.values()) {
      const point = at.clone().project(this.camera);
      node.hidden = Math.max(Math.abs(point.x), Math.abs(point.y), point.z) > 1;
      if (node.hidden) continue;
      // the words stay inside, where their point is
      const half = node.offsetWidth / 2;
      const x = Math.max(half, Math.min(width - half, ((point.x + 1) * width) / 2));
      node.style.transform = `translate(-50%, -50%) translate(${x}px, ${((1 - point.y) * height) / 2}px)`;
    }
  }
}
