"""Overrun of short deadlines by hard requests.

    python -m benchmarks.deadlines --count 200 --seed 0
    python -m benchmarks.deadlines --only "slow TCP" fronts --count 40

The kinds of requests are a TCP so slow that a motion takes minutes, 64 obstacles, motions of ten
minutes with 20,000 samples, 32 targets, the mechanical objective, and fronts. Every request runs in
this process as in a worker, from the validated request to the encoded document, with a deadline of
20 ms to 2 s. The overrun is the time from the deadline until the document or the problem is
complete. The exit code is 1 if an overrun is above MOST_OVERRUN. `--verbose` prints every request.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from benchmarks.tasks import as_pose, collision_free, flange
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.pareto.task import ParetoRequest, ParetoTask
from joulepath.app.engine.result import json_document
from joulepath.app.engine.task import Task
from joulepath.app.http.problems import problem_of
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.optimize import warm_up
from joulepath.optimizer.problem.robots import load_robot

Fields = dict[str, Any]

MOST_OVERRUN = 0.3
"""Largest admissible overrun [s]."""
DEADLINES = (0.02, 0.1, 0.3, 1.0, 2.0)
"""Deadlines of the requests [s]."""
COARSE_PERIOD = 0.03
"""Sample period with which a motion of ten minutes has the largest allowed number of samples
[s]."""
ROBOT = "ur5e"
"""The robot of all requests."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of one request: its kind, deadline [s] and overrun [s], and the status of the
    answer or the type of the problem.
    """

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
    """Start at joint positions, and goal at a pose or at joint positions, at random if `to_pose` is
    None."""
    to_pose = bool(rng.integers(2)) if to_pose is None else to_pose
    return {"start": joint(rng), "goal": pose(rng) if to_pose else joint(rng)}


def slow_tcp(rng: np.random.Generator) -> Fields:
    """A motion of minutes, with a very low speed limit of TCP or elbow."""
    name = str(rng.choice(["tcp_speed", "elbow_speed"]))
    speed = float(np.exp(rng.uniform(np.log(1e-3), np.log(0.05))))
    return between(rng) | {"limits": {name: speed}, "sample_period": 0.02}


def obstacles(rng: np.random.Generator) -> Fields:
    """64 obstacles of four shapes, and a tool of 16 capsules."""
    shapes = []
    for k in range(64):
        at = rng.normal(size=3)
        at *= rng.uniform(0.45, 1.1) / np.linalg.norm(at)
        placed = {
            "name": f"thing {k}",
            "pose": {"position": at.tolist(), "rotvec": rng.uniform(-1, 1, 3).tolist()},
        }
        shape: Fields = [
            {"shape": "sphere", "radius": float(rng.uniform(0.02, 0.06))},
            {"shape": "box", "size": rng.uniform(0.02, 0.12, 3).tolist()},
            {"shape": "cylinder", "radius": 0.03, "length": float(rng.uniform(0.05, 0.4))},
            {"shape": "mesh", "vertices": (rng.normal(size=(64, 3)) * 0.04).tolist()},
        ][k % 4]
        shapes.append(placed | shape)
    capsules = [
        {
            "start": [0, 0, 0.02],
            "end": rng.uniform([-0.05, -0.05, 0.08], [0.05, 0.05, 0.15]).tolist(),
            "radius": 0.01,
        }
        for _ in range(16)
    ]
    return between(rng) | {"scene": {"obstacles": shapes}, "tool": {"capsules": capsules}}


def ten_minutes(rng: np.random.Generator) -> Fields:
    """The longest allowed motion, with the largest allowed number of samples."""
    slow = {"limits": {"tcp_speed": 1.0}} if rng.integers(2) else {}
    return between(rng) | slow | {"duration": 600.0, "sample_period": COARSE_PERIOD}


def many_targets(rng: np.random.Generator) -> Fields:
    """32 goal poses, with thousands of pairs of configurations."""
    return {"start": pose(rng), "goal": {"any_of": [pose(rng) for _ in range(32)]}}


def mechanical(rng: np.random.Generator) -> Fields:
    """The mechanical objective, with a lower bound that excludes few candidates."""
    duration = {"max": float(rng.uniform(3, 600))}
    return between(rng, True) | {
        "objective": "mechanical",
        "duration": duration,
        "sample_period": COARSE_PERIOD,
    }


OPTIMIZE: dict[str, Callable[[np.random.Generator], Fields]] = {
    "slow TCP": slow_tcp,
    "obstacles": obstacles,
    "ten minutes": ten_minutes,
    "many targets": many_targets,
    "mechanical": mechanical,
}


def front(rng: np.random.Generator, index: int) -> Task:
    """A front over the durations of a hard request."""
    body = OPTIMIZE[str(rng.choice(list(OPTIMIZE)))](rng)
    if not isinstance(body.get("duration"), dict):
        body.pop("duration", None)
    return ParetoTask(ParetoRequest.model_validate(body | {"points": 12}), "benchmark", "json")


def _optimize(kind: str) -> Callable[[np.random.Generator, int], Task]:
    return lambda rng, index: OptimizeTask(
        OptimizeRequest.model_validate(OPTIMIZE[kind](rng)), "benchmark"
    )


KINDS: dict[str, Callable[[np.random.Generator, int], Task]] = {
    **{kind: _optimize(kind) for kind in OPTIMIZE},
    "fronts": front,
}


def run(kind: str, seed: int, index: int) -> Outcome:
    """Request `index` of a seed and kind, run to its document or problem."""
    rng = np.random.default_rng([seed, index, *kind.encode()])
    task, deadline = KINDS[kind](rng, index), DEADLINES[index % len(DEADLINES)]
    began = time.perf_counter()
    try:
        document = task.run(deadline).document
        result = "optimal" if b'"status":"optimal"' in document else "answered"
    except DeadlineExceeded as error:
        json_document(problem_of(error, "benchmark"))
        result = "deadline exceeded"
    except JoulepathError as error:
        json_document(problem_of(error, "benchmark"))
        result = type(error).__name__
    return Outcome(kind, index, deadline, time.perf_counter() - began - deadline, result)


def main() -> int:
    """Runs the command; returns the exit code."""
    command = parser(__doc__)
    command.add_argument(
        "--count", type=int, default=160, help="requests, the kinds in turn (%(default)s)"
    )
    command.add_argument(
        "--only", nargs="+", choices=KINDS, default=list(KINDS), help="kinds (all)"
    )
    command.add_argument("--verbose", action="store_true", help="a line for each request")
    given = command.parse_args()
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
                f"{count} {name}"
                for name, count in Counter(each.result for each in of_kind).most_common()
            )
            print(f"{kind:26} {max(each.overrun for each in of_kind):+12.3f} s   {counts}")
    late = [each.overrun for each in outcomes]
    print(f"overrun: {Spread.of(late).formatted(' s', 3)}; allowed {MOST_OVERRUN:g} s")
    write_json(
        given.json,
        {"seed": given.seed, "most": MOST_OVERRUN, "outcomes": [vars(each) for each in outcomes]},
    )
    return int(max(late) > MOST_OVERRUN)


if __name__ == "__main__":
    sys.exit(main())
