// The nearest pair of a motion: a line between two points, and its words.
import * as THREE from "three";
import { figure } from "../store/units";
import type { Pictured } from "./pictured";

const PINK = 0xd62f6b;

export interface NearestPair {
  text: string;
  at: number[];
  time: number;
}

/**
 * Draws the line into a group; null where the certificate has no pair. Nothing but the distance of
 * this instant is meant.
 */
export function nearestPair({ motion }: Pictured, group: THREE.Group): NearestPair | null {
  const clearance = motion?.solution.certificate.clearance;
  if (!clearance?.points) return null;
  const ends = clearance.points.map((point) => new THREE.Vector3().fromArray(point));
  const material = new THREE.MeshBasicMaterial({
    color: PINK,
    depthTest: false,
    transparent: true,
  });
  for (const end of ends) {
    const dot = new THREE.Mesh(new THREE.SphereGeometry(0.008, 14, 10), material);
    dot.position.copy(end);
    dot.renderOrder = 2;
    group.add(dot);
  }
  const line = new THREE.LineBasicMaterial({ color: PINK, depthTest: false });
  group.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends), line));
  const [a, b] = [ends[0]!, ends[1]!];
  return {
    text: `${clearance.pair.join(" – ")}: ${figure(a.distanceTo(b) * 1000)} mm at ${figure(clearance.time)} s`,
    at: a.clone().add(b).multiplyScalar(0.5).toArray(),
    time: clearance.time,
  };
}
