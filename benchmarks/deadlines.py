"""Overrun of short deadlines by hard requests. The exit code is 1 if one overruns by more than MOST.

    python -m benchmarks.deadlines --count 200 --seed 0
    python -m benchmarks.deadlines --only "slow TCP" fronts --count 40

Each kind of request is hard in its own way: a TCP or joints so slow that a motion takes minutes, 64 obstacles, motions
of ten minutes with 20,000 samples, 32 targets, free orientations, energy storage, fronts, comparisons, what-ifs, a log
of ten minutes. Each is run as a worker runs it, from the validated request to the encoded document, in this process,
with a deadline of 20 ms to 2 s. The overrun is the time after the deadline at which the document or problem is there.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.service import ROOT
from benchmarks.statistics import Spread
from benchmarks.tasks import as_pose, collision_free, flange
from joulepath.app.engine.result import json_document
from joulepath.app.engine.task import Task
from joulepath.app.http.problem_details import problem_content
from joulepath.app.schemas.compare import CompareRequest
from joulepath.app.schemas.pareto import ParetoRequest
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.schemas.whatif import WhatifRequest
from joulepath.app.tasks.compare import CompareTask
from joulepath.app.tasks.evaluate import EvaluateTask
from joulepath.app.tasks.optimize import OptimizeTask
from joulepath.app.tasks.pareto import ParetoTask
from joulepath.app.tasks.whatif import WhatifTask
from joulepath.models.registry import load_robot
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.optimize import warm_up

Fields = dict[str, Any]

# the greatest overrun that is allowed [s]
MOST = 0.3
# deadlines [s]
DEADLINES = (0.02, 0.1, 0.3, 1.0, 2.0)
# sample period [s] of which motions of ten minutes have as many samples as an answer may have
COARSE = 0.03
# the robot of all requests
ROBOT = "ur5e"


@dataclass(frozen=True)
class Outcome:
    """One request: its kind, deadline and overrun [s], and the status of its answer or the type of its problem."""

    kind: str
    index: int
    deadline: float
    overrun: float
    result: str


def joint(rng: np.random.Generator) -> Fields:
    """A target as joint positions."""
    return {"q": collision_free(rng, load_robot(ROBOT)).tolist()}


def pose(rng: np.random.Generator) -> Fields:
    """A target as a pose."""
    robot = load_robot(ROBOT)
    return {"pose": as_pose(flange(robot, collision_free(rng, robot)))}


def between(rng: np.random.Generator, to_pose: bool | None = None) -> Fields:
    """A start and a goal: a pose, joint positions, or at random one of both."""
    to_pose = bool(rng.integers(2)) if to_pose is None else to_pose
    return {"start": joint(rng), "goal": pose(rng) if to_pose else joint(rng)}


def slow_tcp(rng: np.random.Generator) -> Fields:
    """Minutes long: the TCP creeps."""
    name = str(rng.choice(["tcp_speed", "elbow_speed"]))
    speed = float(np.exp(rng.uniform(np.log(1e-3), np.log(0.05))))
    return between(rng) | {"limits": {name: speed}, "sample_period": 0.02}


def slow_joints(rng: np.random.Generator) -> Fields:
    """Minutes long: the joints creep."""
    name = str(rng.choice(["velocity", "acceleration", "jerk"]))
    return between(rng) | {
        "limits": {name: float(np.exp(rng.uniform(np.log(0.01), np.log(0.3))))},
        "sample_period": 0.02,
    }


def weak_motors(rng: np.random.Generator) -> Fields:
    """Torque limits near what the arm needs to hold itself."""
    return between(rng) | {"limits": {"torque": [float(rng.uniform(40, 80))] * 3 + [float(rng.uniform(5, 15))] * 3}}


def obstacles(rng: np.random.Generator) -> Fields:
    """64 obstacles of every shape, and a tool of many capsules."""
    shapes = []
    for k in range(64):
        at = rng.normal(size=3)
        at *= rng.uniform(0.45, 1.1) / np.linalg.norm(at)
        placed = {"name": f"thing {k}", "pose": {"position": at.tolist(), "rotvec": rng.uniform(-1, 1, 3).tolist()}}
        shape: Fields = [
            {"shape": "sphere", "radius": float(rng.uniform(0.02, 0.06))},
            {"shape": "box", "size": rng.uniform(0.02, 0.12, 3).tolist()},
            {"shape": "cylinder", "radius": 0.03, "length": float(rng.uniform(0.05, 0.4))},
            {"shape": "mesh", "vertices": (rng.normal(size=(64, 3)) * 0.04).tolist()},
        ][k % 4]
        shapes.append(placed | shape)
    capsules = [
        {"start": [0, 0, 0.02], "end": rng.uniform([-0.05, -0.05, 0.08], [0.05, 0.05, 0.15]).tolist(), "radius": 0.01}
        for _ in range(16)
    ]
    return between(rng) | {"scene": {"obstacles": shapes}, "tool": {"capsules": capsules}}


def ten_minutes(rng: np.random.Generator) -> Fields:
    """The longest motion, with as many samples as are allowed."""
    slow = {"limits": {"tcp_speed": 1.0}} if rng.integers(2) else {}
    return between(rng) | slow | {"duration": 600.0, "sample_period": COARSE}


def many_targets(rng: np.random.Generator) -> Fields:
    """32 poses, between them thousands of pairs."""
    return {"start": pose(rng), "goal": {"any_of": [pose(rng) for _ in range(32)]}}


def free_goal(rng: np.random.Generator) -> Fields:
    """Poses whose orientation is free, one or several."""

    def one() -> Fields:
        position = pose(rng)["pose"]["position"]
        return {"pose": {"position": position, "orientation": "free"}}

    return {"start": joint(rng), "goal": one() if rng.integers(2) else {"any_of": [one() for _ in range(6)]}}


def storage(rng: np.random.Generator) -> Fields:
    """Energy storage too small for the surplus, with a payload."""
    bus = {"mode": "storage", "capacity": float(rng.uniform(0.5, 20)), "power": 50.0, "efficiency": 0.9}
    return between(rng) | {"bus": bus, "payload": {"mass": 4.0, "com": [0.0, 0.0, 0.05]}}


def mechanical(rng: np.random.Generator) -> Fields:
    """The mechanical objective, whose bound rules out little."""
    duration = {"max": float(rng.uniform(3, 600))}
    return between(rng, True) | {"objective": "mechanical", "duration": duration, "sample_period": COARSE}


def glass(rng: np.random.Generator) -> Fields:
    """A tool cone around an axis that both ends keep upright, and a dwell."""
    robot = load_robot(ROBOT)
    q = collision_free(rng, robot)
    axis = flange(robot, q)[:3, :3].T @ [0.0, 0.0, 1.0]
    cone = {"axis": axis.tolist(), "direction": [0.0, 0.0, 1.0], "half_angle": 0.3}
    moved = (q + rng.uniform(-2, 2, 6) * [1, 0, 0, 0, 0, 0]).clip(robot.limits.q_min, robot.limits.q_max)
    return {"start": {"q": q.tolist()}, "goal": {"q": moved.tolist()}, "tool_cone": cone, "dwell": {"time": 8.0}}


def methods(rng: np.random.Generator) -> Fields:
    """The other methods."""
    name = str(rng.choice(["time_scaling", "lagrange", "uniform_scaling", "polynomial_ga"]))
    return between(rng, True) | {"method": name} | slow_or_not(rng)


def slow_or_not(rng: np.random.Generator) -> Fields:
    """Limits that make a motion long, one time in three."""
    return {} if rng.integers(3) else {"limits": {"tcp_speed": 0.005}, "sample_period": 0.02}


OPTIMIZE: dict[str, Callable[[np.random.Generator], Fields]] = {
    "slow TCP": slow_tcp,
    "slow joints": slow_joints,
    "weak motors": weak_motors,
    "obstacles": obstacles,
    "ten minutes": ten_minutes,
    "many targets": many_targets,
    "free goal": free_goal,
    "storage": storage,
    "mechanical": mechanical,
    "glass": glass,
    "methods": methods,
}


def optimized(rng: np.random.Generator) -> Fields:
    """A body of one of the kinds above, at random."""
    return OPTIMIZE[str(rng.choice(list(OPTIMIZE)))](rng)


def front(rng: np.random.Generator, index: int) -> Task:
    """A front over the durations of a hard request."""
    body = optimized(rng)
    if not isinstance(body.get("duration"), dict):
        body.pop("duration", None)
    return ParetoTask(ParetoRequest.model_validate(body | {"points": 12}), "benchmark", "json")


def comparison(rng: np.random.Generator, index: int) -> Task:
    """All methods on a hard request, with complete answers."""
    body = optimized(rng)
    body.pop("method", None)
    return CompareTask(CompareRequest.model_validate(body | {"answers": True}), "benchmark")


def changes(rng: np.random.Generator, index: int) -> Task:
    """Eight changed arms of a hard request."""
    rows = [{"name": f"links {k}", "arm": {"link_mass_scale": 0.5 + 0.05 * k}} for k in range(8)]
    return WhatifTask(WhatifRequest.model_validate({"optimize": optimized(rng), "changes": rows}), "benchmark")


def log(rng: np.random.Generator, index: int) -> Task:
    """A log of ten minutes at 100 Hz, with samples, among obstacles."""
    t = np.arange(60_000) * 0.01
    q = collision_free(rng, load_robot(ROBOT)) + 0.2 * np.sin(t[:, None] * rng.uniform(0.2, 2.0, 6))
    body = {"trajectory": {"t": t.tolist(), "q": q.tolist()}, "sample_period": 0.05, "scene": obstacles(rng)["scene"]}
    file = ROOT / "build" / "bench" / "log.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(json_document(body))
    return EvaluateTask(str(file), "json", {}, "json", "benchmark", max(DEADLINES))


def given(rng: np.random.Generator, index: int) -> Task:
    """A motion of a thousand configurations and sixteen changed arms."""
    waypoints = collision_free(rng, load_robot(ROBOT)) + rng.uniform(-0.3, 0.3, (1000, 6))
    evaluate = {"configurations": waypoints.tolist(), "time_per_segment": 0.6}
    rows = [{"name": f"links {k}", "arm": {"link_mass_scale": 0.5 + 0.05 * k}} for k in range(16)]
    return WhatifTask(WhatifRequest.model_validate({"evaluate": evaluate, "changes": rows}), "benchmark")


def _optimize(kind: str) -> Callable[[np.random.Generator, int], Task]:
    return lambda rng, index: OptimizeTask(OptimizeRequest.model_validate(OPTIMIZE[kind](rng)), "benchmark")


KINDS: dict[str, Callable[[np.random.Generator, int], Task]] = {
    **{kind: _optimize(kind) for kind in OPTIMIZE},
    "fronts": front,
    "comparisons": comparison,
    "changes": changes,
    "changes of a given motion": given,
    "logs": log,
}


def run(kind: str, seed: int, index: int) -> Outcome:
    """Request `index` of a seed and kind, run to its document or problem."""
    rng = np.random.default_rng([seed, index, *kind.encode()])
    task, deadline = KINDS[kind](rng, index), DEADLINES[index % len(DEADLINES)]
    if isinstance(task, EvaluateTask):
        # it has no deadline of its own, but the service's longest: parsing alone takes longer than the short ones here
        deadline = max(DEADLINES)
    began = time.perf_counter()
    try:
        document = task.run(deadline).document
        result = "optimal" if b'"status":"optimal"' in document else "answered"
    except DeadlineExceeded as error:
        json_document(problem_content(error, "benchmark"))
        result = "deadline exceeded"
    except JoulepathError as error:
        json_document(problem_content(error, "benchmark"))
        result = type(error).__name__
    return Outcome(kind, index, deadline, time.perf_counter() - began - deadline, result)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    command = parser(__doc__)
    command.add_argument("--count", type=int, default=160, help="requests, the kinds in turn (%(default)s)")
    command.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS), help="kinds (all)")
    command.add_argument("--verbose", action="store_true", help="a line for each request")
    given = command.parse_args(arguments)
    on_one_core()
    warm_up(ROBOT)
    outcomes: list[Outcome] = []
    for number in range(given.count):
        outcome = run(given.only[number % len(given.only)], given.seed, number // len(given.only))
        outcomes.append(outcome)
        if given.verbose:
            measured = f"{outcome.deadline:5.2f} s {outcome.overrun:+7.3f} s"
            print(f"{outcome.kind:26} {outcome.index:3} {measured}  {outcome.result}", flush=True)
    print(f"{'kind':26} {'worst overrun':>14}   outcomes")
    for kind in given.only:
        of_kind = [each for each in outcomes if each.kind == kind]
        if of_kind:
            counts = ", ".join(
                f"{count} {name}" for name, count in Counter(each.result for each in of_kind).most_common()
            )
            print(f"{kind:26} {max(each.overrun for each in of_kind):+12.3f} s   {counts}")
    late = [each.overrun for each in outcomes]
    print(f"overrun: {Spread.of(late).formatted(' s', 3)}; allowed {MOST:g} s")
    write_json(given.json, {"seed": given.seed, "most": MOST, "outcomes": [vars(each) for each in outcomes]})
    return int(max(late) > MOST)


if __name__ == "__main__":
    sys.exit(main())
