// The path of the TCP as a tube, coloured by the power that is drawn there.
import * as THREE from "three";
import { positionOf, type Matrix } from "../store/chain";
import type { Trajectory } from "../store/types";

// cividis: its colours differ in lightness, so that the colour-blind tell them apart
const RAMP = ["#00306f", "#39486b", "#62616d", "#8a7b75", "#b6996a", "#e1bd52", "#ffe945"].map(
  (colour) => new THREE.Color(colour),
);
const MOST = 300;

export const rampStops = RAMP.map((colour) => `#${colour.getHexString()}`);

/** The colour at a share of the scale, from 0 to 1. */
export function rampAt(share: number): THREE.Color {
  const place = (RAMP.length - 1) * share;
  const index = Math.min(Math.floor(place), RAMP.length - 2);
  return RAMP[index]!.clone().lerp(RAMP[index + 1]!, place - index);
}

/** A tube of `radius` [m] along the TCP of a trajectory; `tcp` maps joint positions to its pose. */
export function pathOfPower(
  { q, power }: Trajectory,
  tcp: (q: number[]) => Matrix,
  radius: number,
): THREE.Object3D {
  const step = Math.ceil(q.length / MOST);
  const kept = q.map((_, k) => k).filter((k) => k % step === 0 || k === q.length - 1);
  const points = kept.map((k) => new THREE.Vector3(...positionOf(tcp(q[k]!))));
  if (points.every((point) => point.distanceTo(points[0]!) <= 1e-4)) return new THREE.Group();
  const [least, most] = [Math.min(...power), Math.max(...power)];
  const curve = new THREE.CatmullRomCurve3(points, false, "chordal");
  const segments = kept.length - 1;
  // the tube is cut at the samples, not at even lengths, so that colours stand where they belong
  curve.getUtoTmapping = (u) => u;
  const geometry = new THREE.TubeGeometry(curve, segments, radius, 8);
  const around = geometry.attributes.position!.count / (segments + 1);
  const colours = kept.flatMap((k) => {
    const colour = rampAt((power[k]! - least) / (most - least || 1)).toArray();
    return Array.from({ length: around }, () => colour).flat();
  });
  geometry.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true }));
}
