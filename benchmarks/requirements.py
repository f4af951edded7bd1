"""Requirements on the results of the sections: one row per requirement, one quantity per row."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

Results = dict[str, Any]

MS = 1e3
"""Milliseconds per second."""
PERCENT = 1e2


@dataclass(frozen=True)
class Requirement:
    """A measured `statistic` of a `quantity` [unit] that must be at most, or at least, `bound`."""

    task: str
    quantity: str
    statistic: str
    measured: float
    bound: float
    at_least: bool = False
    digits: int = 0

    @property
    def satisfied(self) -> bool:
        """Whether the measured value satisfies the bound; NaN does not."""
        return self.measured >= self.bound if self.at_least else self.measured <= self.bound

    def row(self) -> list[str]:
        """The cells of the report's table."""
        sign = "≥" if self.at_least else "≤"
        verdict = "yes" if self.satisfied else "**no**"
        values = (f"{sign} {self.bound:g}", f"{self.measured:.{self.digits}f}")
        return [self.task, self.quantity, self.statistic, *values, verdict]


def requirements(results: dict[str, Results | None]) -> list[Requirement]:
    """The requirements of all sections with results."""
    return [
        each
        for name, rows in SECTIONS.items()
        if (found := results.get(name)) is not None
        for each in rows(found)
    ]


def _percentiles(
    task: str, wall: Results, digits: int = 0, **bounds: float
) -> Iterator[Requirement]:
    """Requirements [ms] on percentiles of wall times [s]."""
    names = {"p50": "median", "p95": "95th percentile"}
    return (
        Requirement(task, "time [ms]", names[each], MS * wall[each], bound, digits=digits)
        for each, bound in bounds.items()
    )


def _solver(found: Results) -> Iterator[Requirement]:
    yield from _percentiles("one candidate, B-spline", found["bspline"]["wall"], 1, p50=20, p95=45)
    yield from _percentiles("one candidate, time scaling", found["time_scaling"]["wall"], 1, p50=10)
    ratio = found["self_collision"]["ratio"]
    yield Requirement(
        "one candidate, B-spline",
        "time with / without self-collision constraints",
        "median",
        ratio["p50"],
        1.3,
        digits=2,
    )


def _http(found: Results) -> Iterator[Requirement]:
    yield from _percentiles(
        "request, joint to pose", found["wall"]["joint to pose"], p50=100, p95=250
    )
    yield from _gap("request, joint to pose", found["gap"], p50=5, p90=11)


def _scenes(found: Results) -> Iterator[Requirement]:
    for kind, bound in (("one candidate", 250), ("whole request", 1000)):
        task = f"among obstacles, {kind}"
        yield from _percentiles(task, found["wall"][kind], p50=bound)
        solved = PERCENT * found["solved"][kind] / found["count"]
        yield Requirement(task, "solved tasks [%]", "mean", solved, 99, at_least=True, digits=1)
    yield Requirement(
        "among obstacles", "answers in collision", "count", len(found["collisions"]), 0
    )


def _success(found: Results) -> Iterator[Requirement]:
    task = "random feasible requests"
    valid = PERCENT * found["valid_fraction"]
    yield Requirement(task, "valid answers [%]", "mean", valid, 99.9, at_least=True, digits=2)
    yield Requirement(task, "errors found in answers", "count", len(found["errors"]), 0)
    yield from _gap(task, found["gap"], p50=5, p90=14.9)
    excess = PERCENT * found["relative_excess"]
    yield Requirement(
        task, "energy above time scaling, same duration [%]", "maximum", excess, 1, digits=2
    )


def _tight(found: Results) -> Iterator[Requirement]:
    yield from _gap("request, joint to pose, tight bound", found["gap"], p50=4, p90=8.6)


def _gap(task: str, gap: Results, p50: float, p90: float) -> Iterator[Requirement]:
    quantity = "gap, energy / lower bound - 1 [%]"
    yield Requirement(task, quantity, "median", PERCENT * gap["p50"], p50, digits=1)
    yield Requirement(task, quantity, "90th percentile", PERCENT * gap["p90"], p90, digits=1)


def _arms(found: Results) -> Iterator[Requirement]:
    task, rows = "every robot, joint to pose", found["rows"]
    valid = (
        PERCENT * sum(row["answered"] for row in rows) / max(sum(row["count"] for row in rows), 1)
    )
    yield Requirement(task, "answers [%]", "mean", valid, 99, at_least=True, digits=1)
    yield Requirement(task, "wrong answers and refusals", "count", len(found["errors"]), 0)
    for row in rows:
        quantity = "gap, energy / lower bound - 1 [%]"
        yield Requirement(
            f"`{row['robot']}`, to a pose",
            quantity,
            "median",
            PERCENT * row["gap"]["p50"],
            13.6,
            digits=1,
        )
        if row["joints"] > 6:
            yield from _percentiles(f"`{row['robot']}`, to a pose", row["wall"], p50=200, p95=600)


def _quality(found: Results) -> Iterator[Requirement]:
    task = f"best of {found['starts']} starts with {found['control_points']} control points"
    quantity, excess = "energy above it [%]", found["excess"]
    within = PERCENT * found["within_one_percent"]
    yield Requirement(
        task, "tasks with at most 1 % more energy [%]", "mean", within, 95, at_least=True
    )
    yield Requirement(task, quantity, "maximum", PERCENT * excess["maximum"], 3, digits=2)


def _load(found: Results) -> Iterator[Requirement]:
    task, wall = f"{found['clients']} clients for {found['seconds']:.0f} s", found["wall"]
    errors = sum(count for status, count in found["statuses"].items() if status != "200") + len(
        found["lost"]
    )
    yield Requirement(task, "errors", "count", errors, 0)
    yield Requirement(
        task,
        "99th percentile / median of the time",
        "value",
        wall["p99"] / wall["p50"],
        4,
        digits=1,
    )
    growth = found["memory_last"] / found["memory_first"]
    yield Requirement(
        task, "memory, last / second quarter of the time", "median", growth, 1.05, digits=3
    )
    yield Requirement(task, "workers replaced", "runs", 0 if found["same_workers"] else 1, 0)


SECTIONS: dict[str, Callable[[Results], Iterator[Requirement]]] = {
    "solver": _solver,
    "http": _http,
    "scenes": _scenes,
    "success": _success,
    "tight": _tight,
    "arms": _arms,
    "quality": _quality,
    "load": _load,
}
