// What the picture holds: arms, ghosts, obstacles, the path of the TCP, the nearest pair, the names
// of stops.
import * as THREE from "three";
import { Chain, IDENTITY, multiply, positionOf, sampleAt, type Matrix } from "../store/chain";
import { legAt, stopsOf } from "../store/cycle";
import { ghosts, run, show, time } from "../store/state";
import type { Obstacle, Pose } from "../store/types";
import { figure } from "../store/units";
import { Arm } from "./arm";
import type { Labels } from "./labels";
import { drawnObstacle } from "./obstacles";
import { nearestPair, type NearestPair } from "./nearest";
import { ON_BASE, type Parts } from "./parts";
import { pathOfPower } from "./path";
import { pictured, type Pictured } from "./pictured";
import { reachedGhost } from "./reachedGhost";
import { place } from "./shapes";
import { colour } from "./theme";

const NEAR = 0.5; // of a cycle, for which the nearest pair is shown before and after its instant [s]
const SAMPLES = 24; // of a motion that the picture is to hold

interface Built {
  robot: string;
  chain: Chain;
  tcp: Partial<Pose> | undefined;
  samples: number[][];
  moves: boolean;
  /** Whether it is of a place that is looked at, so that the view stays. */
  looks: boolean;
}

export class Content {
  arms: Arm[] = [];
  chain: Chain | null = null;
  /** Names of the obstacles that do not count on the present leg. */
  ignored: string[] = [];
  private drawn: Pictured | null = null;
  private scene = "";
  private base = IDENTITY;
  private nearest: NearestPair | null = null;

  constructor(
    private readonly parts: Parts,
    private readonly labels: Labels,
    private readonly redraw: () => void,
  ) {}

  /** Everything anew. */
  build(): Built | null {
    const now = pictured.value;
    if (!now) return null;
    this.drawn = now;
    this.chain = new Chain(now.robot);
    for (const name of ["arms", "path"] as const) empty(this.parts[name]);
    this.arms = now.motion ? now.arms.map((_, k) => this.moving(now, k)) : [this.still(now)];
    this.drawScene(now.cell.scene?.obstacles ?? []);
    empty(this.parts.nearest);
    this.nearest = nearestPair(now, this.parts.nearest);
    this.nameStops(now);
    this.buildGhosts();
    return {
      robot: now.robot.name,
      chain: this.chain,
      tcp: now.cell.tcp,
      samples: samplesOf(now),
      moves: Boolean(now.motion),
      looks: now.elsewhere,
    };
  }

  private moving(now: Pictured, k: number): Arm {
    const { solution, colour: tint } = now.arms[k]!;
    const loads = now.motion?.cycle?.loads.map(({ payload }) => payload);
    const arm = this.armOf(now, { ...(k ? { tint } : {}), ...(loads ? { loads } : {}) });
    this.parts.arms.add(arm.object);
    this.parts.path.add(pathOfPower(solution.trajectory, (q) => this.tcpAt(q), k ? 0.006 : 0.009));
    return arm;
  }

  private still(now: Pictured): Arm {
    const arm = this.armOf(now, {});
    arm.pose(now.start);
    this.parts.arms.add(arm.object);
    return arm;
  }

  /** An arm with its tool and payload; without them where the request is of wrong types. */
  private armOf(now: Pictured, options: ConstructorParameters<typeof Arm>[3]): Arm {
    try {
      return new Arm(this.chain!, now.robot, now.cell, options);
    } catch {
      return new Arm(this.chain!, now.robot, {}, { ...options, loads: [] });
    }
  }

  /** Frames of the first arm as it stands now. */
  get frames(): Matrix[] {
    const frames = this.arms[0]?.frames ?? [];
    return this.base === IDENTITY ? frames : frames.map((T) => multiply(this.base, T));
  }

  /** Puts the base of the arm somewhere. */
  stand(base: Matrix): void {
    this.base = base;
    for (const name of ON_BASE) place(this.parts[name], base);
    this.labels.base.fromArray(base).transpose();
  }

  /** The pose of the TCP at joint positions, in the frame of the base. */
  tcpAt(q: number[]): Matrix {
    return this.chain!.tcp(q, this.drawn?.cell.tcp);
  }

  private drawScene(obstacles: Obstacle[]): void {
    const key = JSON.stringify(obstacles);
    if (key === this.scene) return;
    this.scene = key;
    for (const name of ["obstacles", "margins"] as const) empty(this.parts[name]);
    for (const obstacle of obstacles) {
      try {
        this.obstacle(obstacle);
      } catch {
        // what is wrong with it, the service says
      }
    }
  }

  /** Draws the scene again in the colours of the present theme. */
  recolour(): void {
    this.scene = "";
  }

  private obstacle(obstacle: Obstacle): void {
    const { object, shell } = drawnObstacle(obstacle, this.redraw);
    this.parts.obstacles.add(object);
    if (shell) this.parts.margins.add(shell);
  }

  showMargins(over: THREE.Object3D | null = null): void {
    for (const shell of this.parts.margins.children)
      shell.visible = show.value.margins || shell.userData.of === over;
  }

  /** Start and goal, configurations that are looked at, and the best goal so far. */
  buildGhosts(): void {
    empty(this.parts.ghosts);
    const now = this.drawn;
    if (!now) return;
    const ghost = (q: number[], tint: number, opacity: number) => {
      const arm = this.armOf(now, { tint, opacity });
      arm.pose(q);
      this.parts.ghosts.add(arm.object);
    };
    if (now.motion) ghost(now.start, colour("--start"), 0.2);
    // a cycle ends where it begins
    if (now.goal) ghost(now.goal, colour("--goal"), 0.2);
    for (const { q, colour: tint } of ghosts.value) ghost(q, tint, 0.42);
    const best = reachedGhost.value ?? run.value?.incumbents.at(-1)?.q_goal;
    if (best?.length === now.robot.joints.length) ghost(best, colour("--good"), 0.42);
    this.nameEnds(now);
    this.redraw();
  }

  private nameEnds(now: Pictured): void {
    for (const [end, name, q] of [
      ["start", "Start", now.motion?.cycle ? null : now.start],
      ["goal", now.goalName, now.goal],
    ] as const) {
      if (!q || !show.value.ghosts) this.labels.drop(end);
      else this.labels.put(end, name, positionOf(this.tcpAt(q)), `end ${end}`);
    }
  }

  /** The stops of a cycle, by their names; several may be at one place. */
  private nameStops({ motion }: Pictured): void {
    const places = new Map<string, string[]>();
    const stops = motion?.cycle ? stopsOf(motion.cycle) : [];
    for (const [name, q] of new Map(stops.map(({ stop, q }) => [stop ?? "", q]))) {
      const at = positionOf(this.tcpAt(q))
        .map((value) => value.toFixed(3))
        .join();
      if (!name.includes("/")) places.set(at, [...(places.get(at) ?? []), name]);
    }
    [...places].forEach(([at, names], k) =>
      this.labels.put(`stop ${k}`, names.join(", "), at.split(",").map(Number), "stop"),
    );
    this.labels.keep("stop", places.size);
  }

  /** The arms at the present time, and what is switched on. */
  pose(): void {
    const now = this.drawn;
    if (!now) return;
    const cycle = now.motion?.cycle;
    const leg = cycle ? legAt(cycle.loads, time.value) : 0;
    this.ignored = cycle?.loads[leg]?.ignored ?? [];
    if (now.motion)
      this.arms.forEach((arm, k) => {
        const { t, q } = now.arms[k]!.solution.trajectory;
        arm.pose(sampleAt(t, q, time.value));
        arm.carry(leg);
      });
    for (const arm of this.arms) arm.showCapsules(show.value.capsules);
    for (const name of ["ghosts", "path", "axes"] as const)
      this.parts[name].visible = show.value[name];
    // in a cycle the arm is elsewhere most of the time
    const near =
      this.nearest &&
      show.value.nearest &&
      (!cycle || Math.abs(time.value - this.nearest.time) < NEAR);
    this.parts.nearest.visible = Boolean(near);
    if (near) this.labels.put("nearest", this.nearest!.text, this.nearest!.at, "near");
    else this.labels.drop("nearest");
    this.nameEnds(now);
    this.showMargins();
    this.nameArms(now);
  }

  private nameArms(now: Pictured): void {
    const several = now.arms.length > 1;
    this.labels.keep("arm", several ? now.arms.length : 0);
    if (!several) return;
    now.arms.forEach(({ name, solution }, k) => {
      const [x, y, z] = positionOf(this.arms[k]!.frames.at(-1)!);
      this.labels.put(
        `arm ${k}`,
        `${name}: ${figure(solution.energy.electrical.total)} J`,
        [x, y, z + 0.08 + 0.07 * k],
        "arm",
      );
    });
  }
}

/** Postures that the picture is to hold. */
function samplesOf(now: Pictured): number[][] {
  const trajectory = now.motion?.solution.trajectory;
  if (!trajectory) return [now.start, now.goal ?? now.start];
  const { t, q } = trajectory;
  return Array.from({ length: SAMPLES }, (_, k) => sampleAt(t, q, (t.at(-1)! * k) / (SAMPLES - 1)));
}

/** Takes everything out of a group. */
export function empty(group: THREE.Group): void {
  // what other arms share is sent to the graphics card again when it is next drawn
  group.traverse((each) => (each as Partial<THREE.Mesh>).geometry?.dispose());
  group.clear();
}
