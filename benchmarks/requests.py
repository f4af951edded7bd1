"""Random requests against the real service over HTTP, every answer checked: exits with 1 when a line is missed.

    python -m benchmarks.requests --count 300 --seed 0

Starts the service with its default settings and sends joint-to-pose and pose-to-pose requests in turn. Each answer's
certificate is read and its spline replayed here; baselines, energy identity and bound are compared; for some, the
time-scaled motion of the same duration is asked for too. `--varied` adds payloads, mounts, tighter limits, durations.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

from benchmarks.checks import faults, identity_error, objective
from benchmarks.command import keep, parser
from benchmarks.figures import Spread
from benchmarks.service import Answer, Client, Service, running
from benchmarks.tasks import KINDS, Ask, asks

ANSWERED = 0.99  # share that must be answered with a motion
NO_BETTER = 1e-2  # how far above the time-scaled motion's energy ours may be
PROBLEM = "application/problem+json"
TOO_SHORT = "duration-too-short"


@dataclass
class Outcome:
    """What came of one request."""

    task: Ask
    status: int = 0
    wall: float = 0.0
    refusal: str | None = None
    faults: list[str] = field(default_factory=list)
    energy: float = 0.0
    gap: float = 0.0
    identity: float = 0.0
    candidates: int = 0
    solves: int = 0
    optimal: bool = False
    relative_excess: float | None = None  # ours over the time-scaled motion's energy, minus 1
    bytes: int = 0

    @property
    def name(self) -> str:
        """Where to find the task again."""
        return f"seed {self.task.seed} index {self.task.index} ({self.task.kind})"


def examine(task: Ask, answer: Answer) -> Outcome:
    """One answer against its request."""
    outcome = Outcome(task, answer.status, answer.wall, bytes=len(answer.raw))
    content = answer.content
    if answer.status != 200:
        typed = answer.headers.get("content-type", "").startswith(PROBLEM) and answer.status < 500
        outcome.refusal = str(content.get("type", "")).rpartition("/")[2] or "untyped"
        if not typed:
            outcome.faults.append(f"{answer.status} {outcome.refusal} is no typed refusal")
        return outcome
    outcome.faults = faults(task.body, content, task.T_start, task.T_goal)
    outcome.energy = objective(content)
    outcome.gap = content["energy"]["optimality_gap"]
    outcome.identity = identity_error(content)
    outcome.candidates = len(content["candidates"])
    outcome.solves = content["solver"]["nlp_solves"]
    outcome.optimal = content["status"] == "optimal"
    return outcome


def compare_with_line(client: Client, task: Ask, outcome: Outcome, duration: float) -> None:
    """Ask for the time-scaled motion of the same duration, and note how much relative_excess ours is."""
    answer = client.optimize({**task.body, "method": "time_scaling", "duration": duration})
    content = answer.content
    if answer.status == 200:
        outcome.relative_excess = outcome.energy / objective(content) - 1
    elif answer.status >= 500 or not answer.headers.get("content-type", "").startswith(PROBLEM):
        outcome.faults.append(f"time scaling: {answer.status}")


def ask_all(service: Service, tasks: Sequence[Ask], clients: int = 1, line_every: int = 0) -> list[Outcome]:
    """Send every task, `clients` at a time, and examine the answers; every `line_every`-th also asks for the line."""
    local = threading.local()

    def one(task: Ask) -> Outcome:
        if not hasattr(local, "client"):
            local.client = service.client()
        answer = local.client.optimize(task.body)
        outcome = examine(task, answer)
        # by pairs, so that both kinds have their turn
        if line_every and (task.index // len(KINDS)) % line_every == 0 and outcome.status == 200:
            compare_with_line(local.client, task, outcome, answer.content["duration"])
        return outcome

    with ThreadPoolExecutor(clients) as threads:
        return list(threads.map(one, tasks))


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of a run."""
    solved = [o for o in outcomes if o.status == 200]
    valid = [o for o in solved if not o.faults]
    relative_excess = [o.relative_excess for o in outcomes if o.relative_excess is not None]
    return {
        "count": len(outcomes),
        "answered": len(solved),
        "valid": len(valid),
        "share": len(valid) / max(len(outcomes), 1),
        "optimal": sum(o.optimal for o in solved),
        "refusals": dict(Counter(o.refusal for o in outcomes if o.refusal)),
        "refused": [f"{o.name}: {o.refusal}" for o in outcomes if o.refusal],
        "faults": [f"{o.name}: {fault}" for o in outcomes for fault in o.faults],
        "identity": max((o.identity for o in solved), default=0.0),
        "gap": Spread.of([o.gap for o in solved]),
        "gaps": {kind: Spread.of([o.gap for o in solved if o.task.kind == kind]) for kind in KINDS},
        "loosest": max(solved, key=lambda o: o.gap).name if solved else "",
        "wall": {kind: Spread.of([o.wall for o in solved if o.task.kind == kind]) for kind in KINDS},
        "slowest": max(outcomes, key=lambda o: o.wall).name if outcomes else "",
        "candidates": Spread.of([o.candidates for o in solved]),
        "solves": Spread.of([o.solves for o in solved]),
        "megabytes": Spread.of([o.bytes / 1e6 for o in solved]),
        "compared": len(relative_excess),
        "relative_excess": max(relative_excess, default=0.0),
        "dearest": max(
            (o for o in outcomes if o.relative_excess is not None), key=lambda o: o.relative_excess or 0.0
        ).name
        if relative_excess
        else "",
    }


def misses(figures: dict[str, Any]) -> list[str]:
    """Acceptance lines that a run misses."""
    found = list(figures["faults"])
    if figures["share"] < ANSWERED:
        found.append(f"only {figures['share']:.2%} answered with a valid certificate: at least {ANSWERED:.0%} must be")
    if figures["relative_excess"] > NO_BETTER:
        found.append(
            f"{figures['relative_excess']:.2%} relative_excess than the time-scaled motion in {figures['dearest']}"
        )
    return found


def tell(figures: dict[str, Any]) -> None:
    """Print a run's figures."""
    print(f"answered 200 with a valid certificate  {figures['valid']} of {figures['count']} ({figures['share']:.2%})")
    print(f"status optimal                         {figures['optimal']} of {figures['answered']}")
    print(f"typed refusals                         {figures['refusals'] or 'none'}")
    for line in figures["refused"][:20]:
        print(f"    {line}")
    print(f"energy identity, worst                 {figures['identity']:.1e} of the total")
    gap = figures["gap"]
    print(
        f"proven gap                             p50 {gap.p50:.1%}, p90 {gap.p90:.1%}, widest in {figures['loosest']}"
    )
    for kind, gap in figures["gaps"].items():
        print(f"    {kind:14s}                     p50 {gap.p50:.1%}, p90 {gap.p90:.1%}, most {gap.most:.1%}")
    for kind, wall in figures["wall"].items():
        print(f"wall time, {kind:14s}              {wall.times(1e3).told(' ms', 0)}")
    print(f"slowest                                {figures['slowest']}")
    print(f"candidates looked at                   {figures['candidates'].told('', 0)}")
    print(f"programmes solved                      {figures['solves'].told('', 0)}")
    print(
        f"B-spline over time-scaled, worst       {figures['relative_excess']:+.2%} of {figures['compared']} compared, "
        f"same duration {figures['dearest'] and '(' + figures['dearest'] + ')'}"
    )


def main() -> int:
    """Run and judge."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=300, help="requests (%(default)s)")
    arguments.add_argument("--clients", type=int, default=1, help="requests at a time (%(default)s)")
    arguments.add_argument("--kind", choices=KINDS, help="all of one kind (in turn)")
    arguments.add_argument("--line-every", type=int, default=5, help="compare every n-th of a kind with the line")
    arguments.add_argument("--varied", action="store_true", help="requests that use every field; some are infeasible")
    given = arguments.parse_args()
    tasks = list(asks(given.seed, given.count, given.kind, given.varied))
    with running() as service:
        outcomes = ask_all(service, tasks, given.clients, 0 if given.varied else given.line_every)
    figures = summary(outcomes)
    tell(figures)
    keep(given.json, figures)
    missed = misses(figures) if not given.varied else figures["faults"]
    for line in missed:
        print(f"MISSED: {line}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
