"""Random requests to the service over HTTP, with checks of all answers.

    python -m benchmarks.requests --count 300 --seed 0
    python -m benchmarks.requests --count 200 --robot panda --kind "joint to pose"
    python -m benchmarks.requests --count 100 --kind "joint to pose" --bound tight --line-every 0

The command starts the service with its default settings and sends joint-to-pose and pose-to-pose
requests alternately, from one client or from `--clients`. It checks the certificate, replays the
spline, and compares energy balance, baselines and lower bound. Every task number `--line-every` is
also solved by time scaling with the same duration. The exit code is 1 if a requirement fails.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

from benchmarks.checks import balance_error, errors_found, gap_of, objective
from benchmarks.command import parser, verdict
from benchmarks.service import Answer, Client, Service, running
from benchmarks.statistics import Spread
from benchmarks.tasks import KINDS, RequestTask, request_tasks
from joulepath.models.registry import robot_names

LEAST_VALID = 0.99
"""Smallest admissible fraction of valid answers [1]."""
MOST_EXCESS = 1e-2
"""Largest admissible relative excess of the energy over that of the time-scaled motion [1]."""
PROBLEM = "application/problem+json"


@dataclass
class Outcome:
    """Result of one request: status, wall time [s], errors, and figures of the answer.

    `energy` is the energy of the objective [J]; `relative_excess` is its excess over the energy of
    the time-scaled motion.
    """

    task: RequestTask
    status: int = 0
    wall: float = 0.0
    problem: str | None = None
    errors: list[str] = field(default_factory=list)
    energy: float = 0.0
    gap: float = 0.0
    balance_error: float = 0.0
    candidates: int = 0
    solves: int = 0
    optimal: bool = False
    relative_excess: float | None = None

    @property
    def name(self) -> str:
        """Seed, index and kind of the task."""
        return f"seed {self.task.seed} index {self.task.index} ({self.task.kind})"


def examine(task: RequestTask, answer: Answer) -> Outcome:
    """The result of a request: its answer, checked."""
    outcome = Outcome(task, answer.status, answer.wall)
    content = answer.content
    if answer.status != 200:
        typed = answer.headers.get("content-type", "").startswith(PROBLEM) and answer.status < 500
        outcome.problem = str(content.get("type", "")).rpartition("/")[2] or "untyped"
        if not typed:
            outcome.errors.append(
                f"{answer.status} {outcome.problem} is no problem of the contract"
            )
        return outcome
    outcome.errors = errors_found(task.body, content, task.T_start, task.T_goal)
    outcome.energy = objective(content)
    outcome.gap = gap_of(content["energy"]["optimality_gap"])
    outcome.balance_error = balance_error(content)
    outcome.candidates = sum(content["candidate_counts"].values())
    outcome.solves = content["solver"]["nlp_solves"]
    outcome.optimal = content["status"] == "optimal"
    return outcome


def compare_with_line(client: Client, task: RequestTask, outcome: Outcome, duration: float) -> None:
    """Requests the time-scaled motion of the same duration [s], and sets the relative excess."""
    answer = client.optimize({**task.body, "method": "time_scaling", "duration": duration})
    content = answer.content
    if answer.status == 200:
        outcome.relative_excess = outcome.energy / objective(content) - 1
    elif answer.status >= 500 or not answer.headers.get("content-type", "").startswith(PROBLEM):
        outcome.errors.append(f"time scaling: {answer.status}")


def send_all(
    service: Service, tasks: Sequence[RequestTask], clients: int = 1, line_every: int = 0
) -> list[Outcome]:
    """Sends the tasks from `clients` clients, and checks the answers.

    One pair of tasks in `line_every` is compared with the time-scaled line; none if it is zero.
    """
    local = threading.local()

    def one(task: RequestTask) -> Outcome:
        if not hasattr(local, "client"):
            local.client = service.client()
        answer = local.client.optimize(task.body)
        outcome = examine(task, answer)
        # selected by pairs, so that both kinds of tasks are compared
        if line_every and (task.index // len(KINDS)) % line_every == 0 and outcome.status == 200:
            compare_with_line(local.client, task, outcome, answer.content["duration"])
        return outcome

    with ThreadPoolExecutor(clients) as threads:
        return list(threads.map(one, tasks))


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Statistics of a run."""
    solved = [o for o in outcomes if o.status == 200]
    valid = [o for o in solved if not o.errors]
    kinds = sorted({o.task.kind for o in solved})
    relative_excess = [o.relative_excess for o in outcomes if o.relative_excess is not None]
    return {
        "count": len(outcomes),
        "answered": len(solved),
        "valid": len(valid),
        "valid_fraction": len(valid) / max(len(outcomes), 1),
        "optimal": sum(o.optimal for o in solved),
        "problems": dict(Counter(o.problem for o in outcomes if o.problem)),
        "refused": [f"{o.name}: {o.problem}" for o in outcomes if o.problem],
        "errors": [f"{o.name}: {error}" for o in outcomes for error in o.errors],
        "balance_error": max((o.balance_error for o in solved), default=0.0),
        "gap": Spread.of([o.gap for o in solved]),
        "gaps": {kind: Spread.of([o.gap for o in solved if o.task.kind == kind]) for kind in kinds},
        "widest": max(solved, key=lambda o: o.gap).name if solved else "",
        "wall": {
            kind: Spread.of([o.wall for o in solved if o.task.kind == kind]) for kind in kinds
        },
        "slowest": max(outcomes, key=lambda o: o.wall).name if outcomes else "",
        "candidates": Spread.of([o.candidates for o in solved]),
        "solves": Spread.of([o.solves for o in solved]),
        "compared": len(relative_excess),
        "relative_excess": max(relative_excess, default=0.0),
        "worst": max(
            (o for o in outcomes if o.relative_excess is not None),
            key=lambda o: o.relative_excess or 0.0,
        ).name
        if relative_excess
        else "",
    }


def failed_requirements(results: dict[str, Any]) -> list[str]:
    """A message for every failed requirement of a run."""
    found = list(results["errors"])
    if results["valid_fraction"] < LEAST_VALID:
        found.append(
            f"{results['valid_fraction']:.2%} of the answers are valid: required {LEAST_VALID:.0%} "
            "or more"
        )
    if results["relative_excess"] > MOST_EXCESS:
        found.append(
            f"{results['worst']}: {results['relative_excess']:.2%} more energy than the "
            f"time-scaled motion, required {MOST_EXCESS:.0%} or less"
        )
    return found


def print_summary(results: dict[str, Any]) -> None:
    """Prints the statistics of a run."""
    print(
        f"valid answers                 {results['valid']} of {results['count']} "
        f"({results['valid_fraction']:.2%})"
    )
    print(f"status optimal                {results['optimal']} of {results['answered']}")
    print(f"problems                      {results['problems'] or 'none'}")
    for line in results["refused"][:20]:
        print(f"    {line}")
    print(f"energy balance, largest error {results['balance_error']:.1e} of the total")
    print(
        f"gap                           median {results['gap'].p50:.1%}, "
        f"90th percentile {results['gap'].p90:.1%}, maximum in {results['widest']}"
    )
    for kind, gap in results["gaps"].items():
        print(
            f"    {kind:14s}            median {gap.p50:.1%}, 90th percentile {gap.p90:.1%}, "
            f"maximum {gap.maximum:.1%}"
        )
    for kind, wall in results["wall"].items():
        print(f"wall time, {kind:14s}     {wall.times(1e3).formatted(' ms', 0)}")
    print(f"slowest                       {results['slowest']}")
    print(f"candidates                    {results['candidates'].formatted('', 0)}")
    print(f"NLPs solved                   {results['solves'].formatted('', 0)}")
    print(
        f"excess over time scaling      maximum {results['relative_excess']:+.2%} of "
        f"{results['compared']} tasks with the same duration "
        f"{results['worst'] and '(' + results['worst'] + ')'}"
    )


def main() -> int:
    """Runs the requests and checks the requirements."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=300, help="requests (%(default)s)")
    arguments.add_argument(
        "--clients", type=int, default=1, help="simultaneous requests (%(default)s)"
    )
    arguments.add_argument(
        "--robot", choices=robot_names(), default="ur5e", help="robot (%(default)s)"
    )
    arguments.add_argument(
        "--bound", choices=("normal", "tight"), default="normal", help="bound (%(default)s)"
    )
    arguments.add_argument("--kind", choices=KINDS, help="(default: alternately)")
    arguments.add_argument(
        "--line-every", type=int, default=5, help="one comparison in so many tasks (0: none)"
    )
    given = arguments.parse_args()
    tasks = list(request_tasks(given.seed, given.count, given.kind, given.robot))
    tasks = [replace(task, body=task.body | {"bound": given.bound}) for task in tasks]
    with running() as service:
        outcomes = send_all(service, tasks, given.clients, given.line_every)
    results = summary(outcomes)
    print_summary(results)
    return verdict(given.json, results, failed_requirements(results))


if __name__ == "__main__":
    sys.exit(main())
