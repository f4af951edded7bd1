"""How well the endpoints agree on the least energy of one motion.

    python -m benchmarks.agreement --count 100
    python -m benchmarks.agreement --count 10 --kind "isolated bus"

Every random request is answered by `/optimize` with a free duration, with the duration of that
answer and with durations around it, by `/pareto`, by `/compare`, and by `/cycle` as an open cycle
of one stop. All are the same problem, or a more constrained one. Reported are the relative
differences of the energies from that of the free answer; of durations around it, what they need
less.
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
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import JoulepathError

Json = dict[str, Any]

KINDS = ("plain", "payload", "tight limits", "TCP speed", "isolated bus")
# every second request is of the first robot
ROBOTS = ("ur5e", "panda", "kr10_r1100", "fr3", "ur10e", "iiwa14")
# greatest displacement of a joint [rad] in a short move: half of the moves are short
SHORT = 1.5
# durations around that of the free answer, in multiples of it
AROUND = (0.93, 0.97, 1.03, 1.07)
# points of a front
POINTS = 4
P95 = 1e-3
"""Largest admissible 95th percentile of the relative differences."""
MOST = 3e-3
"""Largest admissible relative difference."""
# relative difference that is rounding: energies in JSON are exact
ROUNDING = 1e-12


@dataclass
class Outcome:
    """What the endpoints answered to a request: the free energy [J], and the relative differences
    from it.
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
    """Request `index` of a seed, and its kind: between joint positions and to a pose in turn."""
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
        q_goal = np.clip(q_start + rng.uniform(-SHORT, SHORT, len(low)), low, high)
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


def examine(index: int, kind: str, body: Json, deadline: float) -> Outcome:
    """Asks every endpoint for the motion of a request."""
    outcome, began = Outcome(index, kind, body), time.process_time()
    free = _answer(
        outcome, "free", OptimizeTask(OptimizeRequest.model_validate(body), ""), deadline
    )
    if free is not None:
        energy, duration = _energy(free), float(free["duration"])
        outcome.energy = energy
        _fixed(outcome, energy, duration, deadline)
        _others(outcome, energy, free, deadline)
    outcome.cpu = time.process_time() - began
    return outcome


def _fixed(outcome: Outcome, energy: float, duration: float, deadline: float) -> None:
    """The fixed duration, that of the free answer and those around it."""
    least, name = energy, "fixed around"
    for scale in (1.0, *AROUND):
        own = "fixed" if scale == 1.0 else name
        asked = OptimizeRequest.model_validate(outcome.request | {"duration": scale * duration})
        # what is faster may be impossible
        into = outcome if scale >= 1.0 else Outcome(0, "", {})
        fixed = _answer(into, own, OptimizeTask(asked, ""), deadline)
        if fixed is None:
            continue
        if scale == 1.0:
            outcome.differences[own] = _energy(fixed) / energy - 1
        least = min(least, _energy(fixed))
    outcome.differences[name] = least / energy - 1


def _others(outcome: Outcome, energy: float, free: Json, deadline: float) -> None:
    """The last point of a front, the row of a comparison, and the cycle of one stop."""
    body = outcome.request
    front = _answer(
        outcome,
        "front",
        ParetoTask(ParetoRequest.model_validate(body | {"points": POINTS}), "", "json"),
        deadline,
    )
    if front is not None:
        last = front["points"][-1]["energy"]
        outcome.differences["front"] = last / energy - 1
        outcome.is_dearer = last > energy * (1 + ROUNDING)
    methods = CompareRequest.model_validate(body | {"methods": ["bspline", "time_scaling"]})
    table = _answer(outcome, "compare", CompareTask(methods, ""), deadline)
    if table is not None:
        outcome.differences["compare"] = table["methods"][0]["electrical"] / energy - 1
    fields = {key: value for key, value in body.items() if key != "goal"}
    stops = [{"name": "goal", "target": body["goal"]}]
    asked = CycleRequest.model_validate(fields | {"stops": stops, "closed": False})
    found = _answer(outcome, "cycle", CycleTask(asked, ""), deadline)
    if found is not None:
        outcome.differences["cycle"] = _energy(found) / energy - 1


def _answer(outcome: Outcome, name: str, task: Any, deadline: float) -> Json | None:
    """The answer of a task as JSON; None for a refusal, which is noted."""
    try:
        content: Json = orjson.loads(task.run(deadline).document)
    except JoulepathError as error:
        outcome.refused[name] = f"{type(error).__name__}: {error}"
        return None
    return content


def _energy(answer: Json) -> float:
    return float(answer["energy"]["electrical"]["total"])


def summary(outcomes: list[Outcome]) -> Json:
    """The spread of the differences by endpoint, with the request of the worst; and what was
    refused.
    """
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
        # the free answer is refused as well where no motion exists
        "refused_by_some": {each.index: each.refused for each in answered if each.refused},
        "cpu": sum(each.cpu for each in outcomes),
    }


def failed_requirements(results: Json) -> list[str]:
    """A message for every requirement that a run fails."""
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
    """Asks the endpoints, prints the differences, and checks the requirements."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=100, help="requests (%(default)s)")
    arguments.add_argument("--kind", choices=KINDS, help="only this kind (default: in turn)")
    arguments.add_argument(
        "--deadline", type=float, default=60.0, help="of each request [s] (%(default)s)"
    )
    given = arguments.parse_args()
    on_one_core()
    outcomes: list[Outcome] = []
    for index in range(given.count):
        outcomes.append(examine(index, *request(given.seed, index, given.kind), given.deadline))
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
