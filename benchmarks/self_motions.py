"""Arms of seven joints: the least energy over all postures that hold a pose, against many fixed postures.

Each task is a move from random joint positions to a random pose, which is asked for as a pose. For comparison, postures
are drawn at random on the self-motions that hold the pose, and each is asked for as joint positions. The self-motions
are cut to the joint ranges. Postures in collision are drawn again. A posture whose proven lower bound is not below the
best energy so far cannot be better, and is not solved.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from benchmarks.tasks import collision_free
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.energy.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.search.run import Run

ROBOTS = ("panda", "iiwa14")
# so long that no search ends early [s]
AMPLE = 600.0
# rounding, and what two searches that stop at the same tolerance may differ by
EQUAL = 1e-3


def main() -> None:
    """Solves the tasks in both ways and prints the differences per robot."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=20, help="tasks per robot (%(default)s)")
    arguments.add_argument("--postures", type=int, default=100, help="fixed postures per task (%(default)s)")
    arguments.add_argument("--robots", nargs="+", default=list(ROBOTS), help="(%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    results = {name: _of_robot(load_robot(name), given.seed, given.count, given.postures) for name in given.robots}
    for name, each in results.items():
        print(
            f"{name}: at or below the best of {given.postures} fixed postures in {each['reached']} of {each['count']}"
        )
        excess = each["excess"]
        print(f"    energy over the best fixed one, median {excess.p50:+.2%}, greatest {excess.maximum:+.2%}")
    write_json(given.json, {"seed": given.seed, "postures": given.postures, "robots": results})


def _of_robot(robot: Robot, seed: int, count: int, postures: int) -> dict[str, Any]:
    compile_kernel(robot)
    rows = [row for row in (_task(robot, seed, index, postures) for index in range(count)) if row is not None]
    excess = [row["energy"] / row["fixed"] - 1 for row in rows]
    return {
        "count": len(rows),
        "reached": sum(each <= EQUAL for each in excess),
        "excess": Spread.of(excess),
        "tasks": rows,
    }


def _task(robot: Robot, seed: int, index: int, postures: int) -> dict[str, Any] | None:
    """Energies [J] of a task; None if not one posture has a motion."""
    rng = np.random.default_rng([seed, index])
    start, goal = collision_free(rng, robot), collision_free(rng, robot)
    T = tcp_pose(Arm(robot=robot), goal)
    fixed = _postures(robot, T, rng, postures)
    energy, best = _energy(robot, start, Pose(T)), _best_of(robot, start, fixed)
    print(f"{robot.name} {index}: {energy:.2f} J, best of {len(fixed)} fixed {best:.2f} J", flush=True)
    return {"index": index, "energy": energy, "fixed": best} if np.isfinite(best) else None


def _best_of(robot: Robot, start: Array, goals: list[Array]) -> float:
    """Least energy [J] of the motions to goals (nq,), each solved by itself; infinite without one."""
    arm, bounds = Arm(robot=robot), list[float]()
    for goal in goals:
        run = Run(Problem(arm=arm, start=start, goal=goal))
        try:
            run.prepare()
        except JoulepathError:
            bounds.append(np.inf)
        else:
            bounds.append(run.incumbent.candidates[0].lower_bound)
    best = np.inf
    for k in np.argsort(bounds).tolist():
        if bounds[k] >= best:
            break
        best = min(best, _energy(robot, start, goals[k]))
    return best


def _energy(robot: Robot, start: Array, goal: Target) -> float:
    """Energy [J] of the motion that is found; infinite without one."""
    try:
        return optimize(Problem(arm=Arm(robot=robot), start=start, goal=goal, deadline=AMPLE)).energy.electrical.total
    except JoulepathError as error:
        if isinstance(goal, Pose):
            print(f"    {error!r}")
        return float("inf")


def _postures(robot: Robot, T: Array, rng: np.random.Generator, count: int) -> list[Array]:
    """Configurations that hold T (4, 4), at random places of the self-motions, free of collisions."""
    kinematics = required_inverse_kinematics(robot, "goal")
    motions = {id(each.self_motion): each.self_motion for each in kinematics.solve(T) if each.self_motion is not None}
    arcs = [(motion, *arc) for motion in motions.values() for arc in motion.arcs]
    lengths = np.array([upper - lower for _, lower, upper in arcs])
    model: CollisionModel = collision_model(Arm(robot=robot))
    found = list[Array]()
    for _ in range(10 * count):
        motion, lower, upper = arcs[int(rng.choice(len(arcs), p=lengths / lengths.sum()))]
        q = motion.at(np.array([rng.uniform(lower, upper)]))[0]
        inside = (q > robot.limits.q_min).all() and (q < robot.limits.q_max).all()
        if inside and model.closest_pairs([q])[0].distance > 0:
            found.append(q)
        if len(found) == count:
            break
    return found


if __name__ == "__main__":
    main()
