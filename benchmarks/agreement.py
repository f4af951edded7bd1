"""Agreement of the endpoints on the least energy of one motion.

    python -m benchmarks.agreement --count 100
    python -m benchmarks.agreement --count 10 --kind "isolated bus"

Every random request is sent to `/optimize` with a free duration, with the duration of this free
answer, and with durations around it; to `/pareto`; to `/compare`; and to `/cycle`, as an open cycle
of one stop. All are the same problem, or a more constrained one. The table has the relative
differences of their energies from the energy of the free answer. For the durations around it, only
an energy below the free answer counts.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import orjson

from benchmarks.command import on_one_core, parser, verdict
from benchmarks.statistics import Spread
from benchmarks.tasks import as_pose, flange
from joulepath.app.api.compare.task import CompareRequest, CompareTask
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import CycleTask
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.pareto.task import ParetoRequest, ParetoTask
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.problem.robots import load_robot

Json = dict[str, Any]

KINDS = ("plain", "payload", "tight limits", "TCP speed", "isolated bus")
ROBOTS = ("ur5e", "panda", "kr10_r1100", "fr3", "ur10e", "iiwa14")
"""Robots of the requests; half of the requests are for the first robot."""
SHORT_MOVE = 1.5
"""Largest displacement of a joint in a short move [rad]; half of the moves are short."""
SCALES = (0.93, 0.97, 1.03, 1.07)
"""Durations around the duration of the free answer, relative to it [1]."""
POINTS = 4
"""Number of points of a front."""
DEADLINE = 60.0
"""Deadline of a request [s]."""
P95 = 1e-3
"""Largest admissible 95th percentile of the relative differences."""
MOST = 3e-3
"""Largest admissible relative difference."""
ROUNDING = 1e-12
"""Relative rounding error of an energy [1]; energies in JSON are exact."""


@dataclass
class Outcome:
    """Answers of the endpoints to a request: the `energy` of the free answer [J], the relative
    `differences` from it, the messages of refusals by endpoint, whether the front ends above the
    free answer, and the processor time [s].
    """

    index: int
    kind: str
    request: Json
    energy: float = np.nan
    differences: dict[str, float] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    is_dearer: bool = False
    cpu: float = 0.0


def request(seed: int, index: int, kind: str | None = None) -> tuple[str, Json]:
    """Kind and body of request `index` of a seed; the goals alternate between joint positions and
    a pose."""
    rng = np.random.default_rng([seed, index])
    kind = KINDS[(index // 2) % len(KINDS)] if kind is None else kind
    name = ROBOTS[0] if rng.random() < 0.5 else str(rng.choice(ROBOTS[1:]))
    robot = load_robot(name)
    q_start, q_goal = _ends(rng, robot)
    goal: Json = (
        {"q": q_goal.tolist()} if index % 2 == 0 else {"pose": as_pose(flange(robot, q_goal))}
    )
    fields: Json = {
        "robot": name,
        "start": {"q": q_start.tolist()},
        "goal": goal,
        "collisions": False,
    }
    return kind, fields | _variation(rng, robot, kind)


def _ends(rng: np.random.Generator, robot: Robot) -> tuple[Array, Array]:
    limits = robot.limits
    low, high = np.maximum(limits.q_min, -np.pi), np.minimum(limits.q_max, np.pi)
    q_start, q_goal = rng.uniform(low, high, (2, len(low)))
    if rng.random() < 0.5:
        q_goal = np.clip(q_start + rng.uniform(-SHORT_MOVE, SHORT_MOVE, len(low)), low, high)
    return q_start, q_goal


def _variation(rng: np.random.Generator, robot: Robot, kind: str) -> Json:
    limits = robot.limits
    if kind in ("payload", "isolated bus"):
        mass = float(rng.uniform(0.3, 0.9) * robot.rated_payload)
        payload = {"mass": mass, "com": rng.uniform([-0.1, -0.1, -0.05], [0.1, 0.1, 0.1]).tolist()}
        return {"payload": payload} | (
            {"bus": {"mode": "isolated"}} if kind == "isolated bus" else {}
        )
    if kind == "tight limits":
        names = {"velocity": limits.v_max, "acceleration": limits.a_max, "jerk": limits.j_max}
        return {
            "limits": {
                name: (value * rng.uniform(0.2, 1.0)).tolist() for name, value in names.items()
            }
        }
    if kind == "TCP speed":
        tcp = {
            "position": rng.uniform(-0.15, 0.15, 3).tolist(),
            "rpy": rng.uniform(-1.0, 1.0, 3).tolist(),
        }
        return {"tcp": tcp, "limits": {"tcp_speed": float(rng.uniform(0.15, 1.0))}}
    return {}


def examine(index: int, kind: str, body: Json) -> Outcome:
    """Sends a request to every endpoint."""
    outcome, began = Outcome(index, kind, body), time.process_time()
    free = _answer(outcome, "free", OptimizeTask(OptimizeRequest.model_validate(body), ""))
    if free is not None:
        outcome.energy = _energy(free)
        _compare_durations(outcome, float(free["duration"]))
        _compare_endpoints(outcome)
    outcome.cpu = time.process_time() - began
    return outcome


def _compare_durations(outcome: Outcome, duration: float) -> None:
    """Fixes the duration of the free answer [s], and durations around it."""
    energy = least = outcome.energy
    for scale in (1.0, *SCALES):
        name = "fixed" if scale == 1.0 else "fixed around"
        asked = OptimizeRequest.model_validate(outcome.request | {"duration": scale * duration})
        # a refusal of a shorter duration is no difference, because the motion may not exist
        recorded = outcome if scale >= 1.0 else Outcome(0, "", {})
        fixed = _answer(recorded, name, OptimizeTask(asked, ""))
        if fixed is None:
            continue
        if scale == 1.0:
            outcome.differences[name] = _energy(fixed) / energy - 1
        least = min(least, _energy(fixed))
    outcome.differences["fixed around"] = least / energy - 1


def _compare_endpoints(outcome: Outcome) -> None:
    """Compares the last point of a front, the row of a comparison, and the cycle of one stop."""
    body, energy = outcome.request, outcome.energy
    fronts = ParetoRequest.model_validate(body | {"points": POINTS})
    front = _answer(outcome, "front", ParetoTask(fronts, "", "json"))
    if front is not None:
        last = front["points"][-1]["energy"]
        outcome.differences["front"] = last / energy - 1
        outcome.is_dearer = last > energy * (1 + ROUNDING)
    methods = CompareRequest.model_validate(body | {"methods": ["bspline", "time_scaling"]})
    table = _answer(outcome, "compare", CompareTask(methods, ""))
    if table is not None:
        outcome.differences["compare"] = table["methods"][0]["electrical"] / energy - 1
    fields = {key: value for key, value in body.items() if key != "goal"}
    stops = [{"name": "goal", "target": body["goal"]}]
    asked = CycleRequest.model_validate(fields | {"stops": stops, "closed": False})
    found = _answer(outcome, "cycle", CycleTask(asked, ""))
    if found is not None:
        outcome.differences["cycle"] = _energy(found) / energy - 1


def _answer(outcome: Outcome, name: str, task: Any) -> Json | None:
    """The answer of a task as JSON; None after a refusal, which is recorded in the outcome."""
    try:
        content: Json = orjson.loads(task.run(DEADLINE).document)
    except JoulepathError as error:
        outcome.refused[name] = f"{type(error).__name__}: {error}"
        return None
    return content


def _energy(answer: Json) -> float:
    return float(answer["energy"]["electrical"]["total"])


def summary(outcomes: list[Outcome]) -> Json:
    """The distribution of the differences by endpoint, and the refusals."""
    answered = [each for each in outcomes if np.isfinite(each.energy)]
    names = ("fixed", "fixed around", "front", "compare", "cycle")
    rows = {name: [each for each in answered if name in each.differences] for name in names}
    return {
        "count": len(outcomes),
        "answered": len(answered),
        "differences": {
            name: Spread.of([abs(each.differences[name]) for each in rows[name]]) for name in names
        },
        "dearer": [each.index for each in answered if each.is_dearer],
        # a request without a motion is refused by all endpoints, and is not listed
        "refused_by_some": {each.index: each.refused for each in answered if each.refused},
        "cpu": sum(each.cpu for each in outcomes),
    }


def failed_requirements(results: Json) -> list[str]:
    """A message for every failed requirement of a run."""
    found = []
    for name, spread in results["differences"].items():
        if spread.p95 > P95 or spread.maximum > MOST:
            found.append(
                f"{name}: 95th percentile {spread.p95:.2%} and maximum {spread.maximum:.2%}, "
                f"required {P95:.2%} and {MOST:.2%} or less"
            )
    found += [f"front: request {index} ends above the free answer" for index in results["dearer"]]
    found += [
        f"request {index}: refused by {name}" for index, name in results["refused_by_some"].items()
    ]
    return found


def main() -> int:
    """Sends the requests, prints the differences, and checks the requirements."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=100, help="requests (%(default)s)")
    arguments.add_argument("--kind", choices=KINDS, help="only this kind (default: in turn)")
    given = arguments.parse_args()
    on_one_core()
    outcomes: list[Outcome] = []
    for index in range(given.count):
        outcomes.append(examine(index, *request(given.seed, index, given.kind)))
        shown = {name: f"{value:+.1e}" for name, value in outcomes[-1].differences.items()}
        print(
            index,
            outcomes[-1].kind,
            shown,
            outcomes[-1].refused or "",
            f"{outcomes[-1].cpu:.1f} s",
            flush=True,
        )
    results = summary(outcomes)
    print(
        f"{results['answered']} of {results['count']} requests have a motion; {results['cpu']:.0f} "
        "s"
    )
    for name, spread in results["differences"].items():
        print(f"{name:14s} {spread.times(100).formatted(' %', 3)}")
    return verdict(given.json, results, failed_requirements(results))


if __name__ == "__main__":
    sys.exit(main())
