"""Fifty calls of every kind of the library, and bitwise fingerprints of their results.

The clock stands still: no deadline passes, however busy the machine is.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from joulepath import (
    AnyOf,
    Arm,
    Attachment,
    Box,
    BranchFilter,
    Bus,
    ConeOrientedPose,
    Cylinder,
    Dwell,
    HalfSpace,
    JoulepathError,
    Obstacle,
    Payload,
    Problem,
    Recording,
    Scene,
    ToolCone,
    Waypoints,
    capsule_between,
    evaluate,
    optimize,
    pareto,
    what_if,
)
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.tool_path.path_following import follow
from joulepath.optimizer.problem.scene import Shape
from tests.optimizer.cells import arm_in_cell, at, wander
from tests.optimizer.moves import (
    CEILING,
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    fixed,
    problem,
    random_moves,
    tcp_pose,
)

# the only measured figure of an answer
MEASURED = {"wall_time"}
DOWN = Rotation.from_euler("x", np.pi).as_rotvec()
HOLDER = capsule_between(np.zeros(3), np.array([0, 0, 0.1]), 0.03)
FLOOR: Shape = HalfSpace()


@dataclass(frozen=True)
class Work:
    """A call with a result that must not depend on other threads."""

    name: str
    run: Callable[[], object]


def still() -> float:
    """A clock without any passing time."""
    return 0.0


def fingerprint(value: Any) -> object:
    """Nested tuples, equal only if the values are bitwise equal."""
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, float | np.floating):
        return struct.pack("d", float(value))
    if isinstance(value, pin.Model) or value is ROBOT:
        return "robot"
    if is_dataclass(value) and not isinstance(value, type):
        parts = (
            (part.name, getattr(value, part.name))
            for part in fields(value)
            if part.name not in MEASURED
        )
        return type(value).__name__, *((name, fingerprint(part)) for name, part in parts)
    if isinstance(value, JoulepathError):
        return type(value).__name__, str(value)
    if isinstance(value, Mapping):
        return tuple((key, fingerprint(part)) for key, part in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(map(fingerprint, value))
    return value


def solved(asked: Problem) -> object:
    try:
        return optimize(asked, still)
    except JoulepathError as error:
        return error


def behind_a_post(height: float = 0.5) -> Problem:
    """A goal on the other side of a post: the answer needs path planning."""
    scene = Scene(
        [
            Obstacle("floor", FLOOR, at([0, 0, -0.02]), 0.01),
            Obstacle("post", Box(np.array([0.08, 0.08, height])), at([0.5, 0, height / 2]), 0.01),
        ]
    )
    arm = Arm(robot=ROBOT, scene=scene, tool=(HOLDER,), T_flange_tcp=at([0, 0, 0.15]))
    ends = []
    for side in (-0.3, 0.3):
        found = inverse_kinematics_for(ROBOT).solve(
            at([0.5, side, 0.15], DOWN), arm.T_flange_tcp, windings=False
        )
        ends.append(
            [
                each.q
                for each in found
                if collision_model(arm).signed_distances(each.q[None])[0].min() > 0
            ]
        )
    start, goal = min(
        ((a, b) for a in ends[0] for b in ends[1]),
        key=lambda both: float(np.ptp(both[1] - both[0])),
    )
    return Problem(arm=arm, start=start, goal=goal)


def replayed(interpolation: Any, arm: Arm) -> object:
    points = np.array([START, START + np.array([-0.4, 0.3, 0.5, -0.6, 0.8, 0.2]), GOAL])
    return evaluate(
        arm, Waypoints(points, np.array([1.1, 1.7]), interpolation), sample_period=0.004
    )


def replayed_log(arm: Arm) -> object:
    t = np.arange(1500) * 0.008
    return evaluate(
        arm, Recording.of(t, START + 0.3 * np.sin(t[:, None] * np.linspace(0.2, 0.7, 6)))
    )


def inverse(seed: int) -> object:
    """All solutions of some poses, and the nearest pair of bodies at every solution."""
    arm, found = arm_in_cell(), []
    for q in np.random.default_rng(seed).uniform(-np.pi, np.pi, (10, 6)):
        solutions = inverse_kinematics_for(ROBOT).solve(tcp_pose(q).T)
        found.append(
            (solutions, collision_model(arm).closest_pairs([each.q for each in solutions]))
        )
    return found


def followed() -> object:
    centre = tcp_pose(START).T[:3, 3]
    circle = np.array(
        [[0.0, 0.08 * np.sin(x), 0.08 * (np.cos(x) - 1)] for x in np.linspace(0, 2 * np.pi, 40)]
    )
    return follow(Arm(robot=ROBOT), centre + circle, START)


def certified(seed: int) -> object:
    """A motion through a cell, some seconds long: quadrature over thousands of samples, distances,
    the proof.
    """
    arm = arm_in_cell()
    spline = wander(seed, duration=6.0)
    ends: tuple[Array, Array] = spline.control_points[0], spline.control_points[-1]
    free = replace(arm, collisions=False)
    asked = Problem(arm=arm if seed % 2 else free, start=ends[0], goal=ends[1])
    return certify(asked, spline, *ends, Plant(arm).energy(spline))


def front(asked: Problem, points: int) -> object:
    return pareto(asked, points, still)


def changed_arm(asked: Problem, changed: Problem) -> object:
    return what_if(optimize(asked, still), changed, still)


def moves() -> list[Work]:
    """Joints to joints: every method, several arms with the same robot, payloads, mountings and
    buses.
    """
    arms: list[dict[str, Any]] = [
        {},
        {"payload": PAYLOAD},
        {"gravity": TILTED, "payload": Payload(4.0, np.array([0.0, 0.05, 0.1]))},
        {"gravity": CEILING, "bus": Bus("isolated")},
        {"link_mass_scale": np.linspace(0.6, 1.4, 6), "friction": "coulomb_viscous"},
        {"bus": Bus("recuperating", efficiency=0.7)},
    ]
    methods = ("bspline", "bspline", "time_scaling", "lagrange", "uniform_scaling")
    found = []
    for k, (start, goal) in enumerate(random_moves(17, 18)):
        method, arm = methods[k % len(methods)], arms[k % len(arms)]
        own: dict[str, Any] = {"objective": "mechanical", **fixed(3.0)} if k % 7 == 3 else {}
        asked = problem(start, goal, method=method, **arm, **own)
        found.append(Work(f"move {k} by {method}", partial(solved, asked)))
    return found


def targets() -> list[Work]:
    """Poses, sets of targets, poses with an orientation tolerance, and unsolvable requests."""
    pose, other = tcp_pose(GOAL), tcp_pose(GOAL + 0.2)
    cone = ConeOrientedPose(pose.T[:3, 3], np.array([0.0, 0.0, 1.0]), pose.T[:3, 2], 0.3)
    unreachable = replace(pose, T=at([3.0, 0.0, 0.5]))
    near = BranchFilter("left", "up", "no_flip")
    asked = {
        "pose": problem(goal=pose),
        "pose to pose": problem(start=tcp_pose(START), goal=pose, windings=False),
        "loaded pose": problem(goal=pose, payload=PAYLOAD, gravity=TILTED),
        "mechanical pose": problem(
            goal=pose, objective="mechanical", branch=near, windings=False, **fixed(2.0)
        ),
        "uniformly scaled pose": problem(goal=pose, method="uniform_scaling"),
        "time scaled pose": problem(goal=other, method="time_scaling"),
        "one of two poses": problem(goal=AnyOf((pose, other)), windings=False),
        "any turn about the tool": problem(
            goal=ConeOrientedPose.about(pose, np.array([0.0, 0.0, 1.0]))
        ),
        "cone": problem(goal=cone),
        "out of reach": problem(goal=unreachable),
        "too short": problem(**fixed(0.05)),
    }
    return [Work(name, partial(solved, each)) for name, each in asked.items()]


def surroundings() -> list[Work]:
    """Collisions, planned paths, constraints along the path, cycles and energy storage."""
    cup = Payload(1.0, shape=Attachment(Cylinder(0.05, 0.2), at([0, 0, 0.25])))
    upright = ToolCone(np.array([0.0, 0.0, 1.0]), tcp_pose(START).T[:3, 2], 0.6)
    wall = Scene([Obstacle("wall", Box(np.array([0.1, 2.0, 2.0])), at([-0.9, 0.0, 0.5]), 0.02)])
    near = START + np.array([0.6, 0.2, -0.3, 0.1, 0.0, 0.4])
    asked = {
        "post": behind_a_post(),
        "lower post": behind_a_post(0.45),
        "wall": problem(START, GOAL, collisions=True, scene=wall),
        "carried cup": problem(
            START, near, collisions=True, scene=wall, payload=cup, tool=(HOLDER,)
        ),
        "upright": problem(START, near, tool_cone=upright),
        "slow": problem(START, GOAL, tcp_speed=0.4, elbow_speed=0.3),
        "dwell": problem(START, GOAL, dwell=Dwell(4.0)),
        "storage": problem(
            START, GOAL, bus=Bus("storage", efficiency=0.9, capacity=20.0, power=200.0)
        ),
    }
    return [Work(name, partial(solved, each)) for name, each in asked.items()]


def other_work() -> list[Work]:
    """Fronts, changed arms, replays, inverse kinematics, certificates, and the genetic
    algorithm."""
    arm, stored = Arm(robot=ROBOT, payload=PAYLOAD), Bus("storage", efficiency=0.9, capacity=5.0)
    genetic = problem(START, GOAL, method="polynomial_ga")
    heavier = problem(START, GOAL, payload=PAYLOAD)
    return [
        Work("genetic algorithm", partial(solved, genetic)),
        Work("front", partial(front, problem(duration_max=3.0), 4)),
        Work("lighter load", partial(changed_arm, heavier, problem())),
        *(
            Work(f"replay {way}", partial(replayed, way, arm))
            for way in ("linear", "quintic", "spline")
        ),
        Work("replay with storage", partial(replayed, "quintic", replace(arm, bus=stored))),
        Work("replayed log", partial(replayed_log, arm)),
        *(Work(f"inverse kinematics {seed}", partial(inverse, seed)) for seed in (1, 2)),
        Work("circle", followed),
        *(Work(f"certificate {seed}", partial(certified, seed)) for seed in (1, 2)),
    ]


def all_work() -> list[Work]:
    """All fifty calls."""
    return [*moves(), *targets(), *surroundings(), *other_work()]
