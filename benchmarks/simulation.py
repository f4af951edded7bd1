"""Answers replayed in MuJoCo: how far the simulated arm is from the plan, and what is left of the savings.

    python -m benchmarks.simulation --count 200
    python -m benchmarks.simulation --count 20 --perturbed 20

The tasks take turns among the robots and among three kinds: joint to joint, joint to pose, and joint to pose among
obstacles. Two of three arms carry a payload, one of four hangs askew. Every answer is replayed with torques known in
advance and a PD loop at 0.25 ms, and with the loop alone; the first `--perturbed` answers also on arms with more and
less payload and friction. Forward dynamics are compared with a third opinion, Pinocchio's articulated-body algorithm,
at the samples of every answer.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.cells import cell_task
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.requirements import PROMISES
from benchmarks.statistics import Spread
from benchmarks.tasks import collision_free, flange
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.energy.kernel_cache import compile_kernel
from joulepath.optimizer.energy.plant import Plant
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.replay.from_solution import planned_motion
from joulepath.optimizer.replay.planned import PlannedMotion
from joulepath.optimizer.replay.replay import Replay, replay
from joulepath.optimizer.replay.simulated_arm import SimulatedArm

ROBOTS = ("ur5e", "ur10e", "panda", "kr10_r1100", "iiwa14", "ur3e", "xarm7")
KINDS = ("joint to joint", "joint to pose", "cell")
PERTURB: Any = {"payload": 0.1, "friction": 0.3}
ASKEW = np.array([3.0, -4.0, -8.4])


def problem_of(seed: int, index: int) -> tuple[str, Problem]:
    """Task `index` of a seed, with its name."""
    kind, rng = KINDS[index % len(KINDS)], np.random.default_rng([seed, index])
    if kind == "cell":
        cell = cell_task(seed, index)
        return "ur5e, cell", Problem(arm=cell.arm, start=cell.q_start, goal=Pose(cell.T_goal))
    robot = load_robot(ROBOTS[index // len(KINDS) % len(ROBOTS)])
    payload = Payload()
    if index % 3:
        mass = float(rng.uniform(0.2, 0.8)) * robot.rated_payload
        payload = Payload(mass=mass, com=rng.uniform([-0.03, -0.03, 0.0], [0.03, 0.03, 0.1]))
    gravity = ASKEW if index % 4 == 3 else np.array([0.0, 0.0, -9.81])
    q_start, q_goal = collision_free(rng, robot), collision_free(rng, robot)
    goal: Array | Pose = q_goal if kind == "joint to joint" or robot.nq != 6 else Pose(flange(robot, q_goal))
    arm = Arm(robot=robot, payload=payload, gravity=gravity)
    return f"{robot.name}, {kind}", Problem(arm=arm, start=q_start, goal=goal)


def third_opinion(plan: PlannedMotion) -> float:
    """Largest relative difference of MuJoCo's accelerations and those of Pinocchio, under the torques of the answer."""
    assert plan.torques is not None
    q, v, _, tau = (getattr(plan.torques, name) for name in ("q", "v", "a", "tau"))
    model = Plant(plan.arm).model
    data = model.createData()
    theirs = np.array([pin.aba(model, data, *state) for state in zip(q, v, tau, strict=True)])
    ours = SimulatedArm(plan.arm).accelerations(q, v, tau)
    return float(np.abs(ours - theirs).max() / plan.arm.active_limits.a_max.max())


def figures(plan: PlannedMotion, found: Replay, control: Any) -> dict[str, float]:
    """The row of one answer under one controller."""
    run = found.runs[control]
    return {
        "torque [1e-9 of the limit]": 1e9 * (found.torque_error or 0.0),
        "joints [mrad]": 1e3 * float(run.joint_error.max()),
        "TCP [mm]": 1e3 * run.tcp_error,
        "electrical [%]": 100 * abs(run.energy.electrical.total / plan.electrical - 1),
        "mechanical [%]": 100 * abs(run.energy.mechanical.total / plan.mechanical - 1),
        "contacts": float(run.collides),
    }


def savings(found: Replay) -> dict[str, float]:
    """How the savings of one answer stand the changes, in points."""
    rows = [each for each in found.savings if each.planned > 0]
    return {
        "saving, simulated - planned [points]": max((100 * abs(r.simulated - r.planned) for r in rows), default=0.0),
        "saving, range [points]": max((100 * (r.most - r.least) for r in rows), default=0.0),
        "savings that persist [%]": 100 * float(np.mean([bool(r.persists) for r in rows])) if rows else 100.0,
        "changed arm, TCP [mm]": max(1e3 * each.outcome.tcp_error for each in found.changes),
        "changed arm, joints that saturate": float(max((each.outcome.saturated > 0).sum() for each in found.changes)),
    }


def main() -> int:
    """Replays every answer and prints deviations; exits with 1 if one is beyond its promise."""
    arguments = parser(__doc__, seed=17)
    arguments.add_argument("--count", type=int, default=200, help="answers (%(default)s)")
    arguments.add_argument("--perturbed", type=int, help="of these on changed arms (a tenth)")
    given = arguments.parse_args()
    on_one_core()
    for name in ROBOTS:
        compile_kernel(load_robot(name))
    perturbed = max(given.count // 10, 1) if given.perturbed is None else given.perturbed
    rows: dict[str, dict[str, list[float]]] = {"feed_forward": {}, "pd": {}, "changed": {}}
    index = answered = 0
    while answered < given.count:
        name, problem = problem_of(given.seed, index)
        index += 1
        try:
            plan = planned_motion(optimize(problem), problem.arm, problem.objective)
        except JoulepathError as error:
            print(f"{index - 1:4d} {name:24s} {type(error).__name__}", flush=True)
            continue
        began = time.perf_counter()
        found = replay(plan, perturb=PERTURB if answered < perturbed else None)
        own = figures(plan, found, "feed_forward")
        own["accelerations, MuJoCo and Pinocchio [1e-9]"] = 1e9 * third_opinion(plan)
        changed = savings(found) if found.changes else {}
        for which, values in (("feed_forward", own), ("pd", figures(plan, found, "pd")), ("changed", changed)):
            for quantity, value in values.items():
                rows[which].setdefault(quantity, []).append(value)
        answered += 1
        text = ", ".join(f"{quantity} {value:.3g}" for quantity, value in own.items())
        print(f"{index - 1:4d} {name:24s} {text}, {time.perf_counter() - began:.2f} s", flush=True)
    return report(rows, given)


def report(rows: dict[str, dict[str, list[float]]], given: Any) -> int:
    """Prints and writes the distributions; 1 if a promise is broken."""
    spreads = {which: {name: Spread.of(values) for name, values in own.items()} for which, own in rows.items()}
    broken = []
    for which, own in spreads.items():
        print(f"== {which}")
        for name, spread in own.items():
            print(f"{name:44s} {spread.formatted(digits=4)}, most {spread.maximum:.4g}, least {spread.minimum:.4g}")
            if which == "feed_forward" and not spread.maximum <= PROMISES[name]:
                broken.append(f"{name}: {spread.maximum:.4g} of at most {PROMISES[name]:g}")
    for each in broken:
        print(f"BROKEN: {each}")
    write_json(given.json, {"seed": given.seed, "count": given.count, **spreads})
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
