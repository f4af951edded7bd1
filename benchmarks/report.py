"""The report benchmarks/RESULTS.md on all sections: requirements, distributions, other planners."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from benchmarks.comparison import PLOT, Comparison, draw
from benchmarks.requirements import MS, PERCENT, Results, requirements
from benchmarks.service import ROOT

RESULTS = ROOT / "benchmarks" / "RESULTS.md"


def write(
    path: Path, machine: Results, results: dict[str, Results | None], took: float, whole: bool
) -> None:
    """Writes the report to `path`, and the plot into the same folder.

    Args:
        path: file of the report.
        machine: description of the machine, by `benchmarks.machine`.
        results: results by section; None without results.
        took: duration of the run [s].
        whole: whether all sections ran.
    """
    planners = Comparison.of(
        {name: found for name, found in results.items() if name.startswith("planner-") and found}
    )
    parts = [
        _heading(machine, took, whole),
        _requirements(results),
        _distributions(results),
        _notes(results),
        _arms(results.get("arms")),
        _load(results.get("load")),
        _foreign(results.get("foreign")),
    ]
    if planners.rows:
        draw(planners, path.with_name(PLOT))
        parts.append(planners.formatted())
    path.write_text("\n\n".join(part for part in parts if part) + "\n", encoding="utf-8")


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _heading(machine: Results, took: float, whole: bool) -> str:
    packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items())
    scope = (
        f"one run of {took / 60:.1f} minutes"
        if whole
        else "several runs, because not all sections ran again"
    )
    return (
        "# Results\n\n"
        f"`make bench` wrote this page on {machine['date']}, in {scope}. Machine: "
        f"{machine['cores']} cores of "
        f"{machine['cpu']}, {machine['memory']:.0f} GiB of memory, load {machine['load']:.1f} "
        "before the run. "
        f"Python {machine['python']}, {packages}. Each number is for one core unless stated "
        "otherwise. Times are wall "
        "times. All tasks are random with a fixed seed, and none is left out: "
        "`benchmarks/tasks.py` and "
        "`benchmarks/cells.py`."
    )


def _requirements(results: dict[str, Results | None]) -> str:
    header = ["task", "quantity", "statistic", "required", "measured", "satisfied"]
    return "## Requirements\n\n" + table(header, (each.row() for each in requirements(results)))


def _distributions(results: dict[str, Results | None]) -> str:
    header = [
        "task",
        "quantity",
        "n",
        "25th percentile",
        "median",
        "75th percentile",
        "95th percentile",
        "maximum",
    ]
    return "## Distributions\n\n" + table(header, _spreads(results))


def _spreads(results: dict[str, Results | None]) -> Iterator[list[str]]:
    """One row per measured distribution."""
    if solver := results.get("solver"):
        yield _spread("one candidate, B-spline", "time [ms]", solver["bspline"]["wall"], MS)
        yield _spread(
            "one candidate, time scaling", "time [ms]", solver["time_scaling"]["wall"], MS
        )
        ratio = solver["self_collision"]["ratio"]
        yield _spread(
            "one candidate, B-spline", "time with / without self-collision constraints", ratio, 1, 2
        )
    if scenes := results.get("scenes"):
        for kind, wall in scenes["wall"].items():
            yield _spread(f"among obstacles, {kind}", "time [ms]", wall, MS, 0)
        yield _spread("among obstacles", "obstacles", scenes["obstacles"], 1, 0)
    for section, how in (
        ("http", "one client"),
        ("success", "two clients"),
        ("tight", "tight bound"),
    ):
        for kind, wall in (results.get(section) or {"wall": {}})["wall"].items():
            if wall["count"]:
                yield _spread(f"request, {kind}, {how}", "time [ms]", wall, MS, 0)
    for section, what in (("success", ""), ("tight", ", tight bound")):
        for kind, gap in (results.get(section) or {"gaps": {}})["gaps"].items():
            if gap["count"]:
                yield _spread(
                    f"random feasible requests, {kind}{what}",
                    "gap, energy / lower bound - 1 [%]",
                    gap,
                    PERCENT,
                )
    if quality := results.get("quality"):
        for name, points in (("excess", "control_points"), ("fine_excess", "fine_control_points")):
            task = f"best of {quality['starts']} starts, {quality[points]} control points"
            yield _spread(task, "energy above it [%]", quality[name], PERCENT, 2)
    if load := results.get("load"):
        yield _spread(f"{load['clients']} clients", "time [ms]", load["wall"], MS, 0)


def _spread(task: str, quantity: str, spread: Results, factor: float, digits: int = 1) -> list[str]:
    values = (spread[name] for name in ("p25", "p50", "p75", "p95", "maximum"))
    # infinite values are null in JSON
    numbers = ("∞" if value is None else f"{value * factor:.{digits}f}" for value in values)
    return [task, quantity, str(spread["count"]), *numbers]


def _notes(results: dict[str, Results | None]) -> str:
    """Single figures, unsolved tasks and errors."""
    lines = []
    if scenes := results.get("scenes"):
        planned = sum(scenes["from_planned_path"].values())
        lines.append(
            f"Among obstacles, the straight line in joint space collides in {scenes['blocked']} "
            "tasks."
        )
        lines.append(
            f"Among obstacles, {planned} answers start from a planned collision-free path."
        )
        lines += [f"Not solved: {each}." for each in scenes["unsolved"]]
    for section in ("http", "success", "tight"):
        found = results.get(section) or {"refused": [], "errors": []}
        lines += [f"Answered with a problem: {each}." for each in found["refused"]]
        lines += [f"Error: {each}." for each in found["errors"]]
    if success := results.get("success"):
        lines.append(f"Energy balance: largest error {success['balance_error']:.0e} of the total.")
    return "## Notes\n\n" + "\n".join(f"- {line}" for line in lines) if lines else ""


def _arms(found: Results | None) -> str:
    """Requests to a pose, per robot."""
    if found is None:
        return ""
    header = [
        "robot",
        "joints",
        "answered",
        "errors",
        "time: median [ms]",
        "95th percentile [ms]",
        "gap: median [%]",
    ]
    rows = (
        [
            f"`{row['robot']}`",
            str(row["joints"]),
            f"{row['answered']} of {row['count']}",
            str(len(row["errors"])),
            *(f"{row['wall'][name] * MS:.0f}" for name in ("p50", "p95")),
            "" if row["gap"]["p50"] is None else f"{PERCENT * row['gap']['p50']:.1f}",
        ]
        for row in found["rows"]
    )
    text = (
        "Random requests from joint positions to a pose, one client, one worker. A refusal without "
        "a true reason is an "
    )
    return f"## Robots\n\n{text}error.\n\n{table(header, rows)}"


def _load(found: Results | None) -> str:
    if found is None:
        return ""
    return (
        "## Load\n\n"
        f"Each of {found['clients']} clients sends its next request as soon as the last one is "
        "answered. "
        f"{found['most_in_flight']} requests are in flight at all times on {found['cores']} "
        "workers. The service gives "
        f"{found['per_second']:.0f} answers per second, {found['answers']} in all. The resident "
        "memory of its "
        f"processes adds up to {found['memory_first']:.0f} MiB in the second quarter of the time, "
        "and to "
        f"{found['memory_last']:.0f} MiB in the last."
    )


def _foreign(found: Results | None) -> str:
    """Planning problems from other sources, per kind of goal and family."""
    if found is None:
        return ""
    times = ["time: median [s]", "95th percentile [s]"]
    rows = (
        [
            row["kind"],
            row["family"],
            f"{row['answered']} of {row['count']}",
            *(f"{row['wall'][name]:.2f}" for name in ("p50", "p95")),
            "" if row["energy"]["p50"] is None else f"{row['energy']['p50']:.0f}",
            ", ".join(f"{count} {name}" for name, count in row["problems"].items()),
        ]
        for row in found["rows"]
    )
    header = ["goal", "family", "answered", *times, "energy: median [J]", "problems"]
    return "## Planning problems of others\n\n" + table(header, rows)
