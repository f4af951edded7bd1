"""benchmarks/RESULTS.md from the sections' figures: the bars first, then what lies behind them, then the peers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from benchmarks.comparison import PLOT, Peers, draw
from benchmarks.service import ROOT

RESULTS = ROOT / "benchmarks" / "RESULTS.md"
MISSING = "not measured"
Figures = dict[str, Any]


def write(path: Path, machine: Figures, figures: dict[str, Figures | None], took: float, whole: bool) -> None:
    """Write the report at `path` and the plot beside it."""
    peers = Peers.of({name: found for name, found in figures.items() if name.startswith("peer-") and found})
    parts = [
        _heading(machine, took, whole),
        _bars(figures),
        _requests(figures),
        _load(figures.get("load")),
        _scaling(figures.get("scaling")),
    ]
    if peers.rows:
        draw(peers, path.with_name(PLOT))
        parts.append(peers.told())
    path.write_text("\n\n".join(part for part in parts if part) + "\n", encoding="utf-8")


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def ms(spread: Figures, digits: int = 0) -> str:
    """Median and 95th percentile of times [s], in ms."""
    return f"p50 {spread['p50'] * 1e3:.{digits}f} ms, p95 {spread['p95'] * 1e3:.{digits}f} ms"


def spread_of(spread: Figures, factor: float, unit: str, digits: int = 1) -> str:
    """The middle half and the greatest."""
    low, high, most = (spread[name] * factor for name in ("p25", "p75", "most"))
    return f"middle half {low:.{digits}f} to {high:.{digits}f}, most {most:.{digits}f} {unit}, n = {spread['count']}"


def verdict(holds: bool) -> str:
    """Whether a bar is held."""
    return "held" if holds else "**missed**"


def _heading(machine: Figures, took: float, whole: bool) -> str:
    packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items())
    scope = f"one run of {took / 60:.1f} minutes" if whole else "several runs: not all sections were run anew"
    return (
        "# Results\n\n"
        f"`make bench` wrote this on {machine['date']}, in {scope}, on {machine['cores']} cores of "
        f"{machine['cpu']} with {machine['memory']:.0f} GiB of memory (load before the run: {machine['load']:.1f}). "
        f"Python {machine['python']}, {packages}. Every number is one core's unless it says otherwise; times are wall "
        "times. All tasks are drawn at random from a seed, none is left out: `benchmarks/tasks.py`."
    )


def _bars(figures: dict[str, Figures | None]) -> str:
    rows = [row for section, judge in JUDGES if (found := figures.get(section)) is not None for row in judge(found)]
    return "## Bars\n\n" + table(["what", "bar", "measured", "", "spread"], rows)


def _solver(found: Figures) -> list[list[str]]:
    spline, line = found["bspline"]["wall"], found["time_scaling"]["wall"]
    return [
        [
            "one candidate, joint to joint: B-spline of 13 control points, duration free, all limits",
            "p50 ≤ 20 ms, p95 ≤ 45 ms",
            ms(spline, 1),
            verdict(spline["p50"] <= 0.020 and spline["p95"] <= 0.045),
            f"{spread_of(spline, 1e3, 'ms')}; {_statuses(found['bspline'])}",
        ],
        [
            "the same on the time-scaled straight line",
            "p50 ≤ 10 ms",
            ms(line, 1),
            verdict(line["p50"] <= 0.010),
            f"{spread_of(line, 1e3, 'ms')}; {_statuses(found['time_scaling'])}",
        ],
        [
            "the B-spline with the arm's own links kept apart, times the same without",
            "p50 ≤ 1.3",
            f"p50 {found['apart']['ratio']['p50']:.2f}, p95 {found['apart']['ratio']['p95']:.2f}",
            verdict(found["apart"]["ratio"]["p50"] <= 1.3),
            spread_of(found["apart"]["ratio"], 1, "", 2),
        ],
    ]


def _scenes(found: Figures) -> list[list[str]]:
    bars = {"one candidate": 0.25, "whole request": 1.0}
    rows = [
        [
            f"among obstacles (table, shelf, bin, cage; p50 {found['obstacles']['p50']:.0f} of them): {kind}",
            f"p50 ≤ {bar * 1e3:.0f} ms",
            ms(found["wall"][kind]),
            verdict(found["wall"][kind]["p50"] <= bar),
            spread_of(found["wall"][kind], 1e3, "ms", 0),
        ]
        for kind, bar in bars.items()
    ]
    solved = [found["solved"][kind] for kind in bars]
    return [
        *rows,
        [
            "the same tasks solved, and answers that hit something when replayed every 0.1 ms by Coal",
            "≥ 99 %, none",
            f"{solved[0]} and {solved[1]} of {found['count']}, {len(found['hits'])}",
            verdict(min(solved) >= 0.99 * found["count"] and not found["hits"]),
            f"{sum(found['led'].values())} of them led around; straight line blocked in {found['blocked']}",
        ],
    ]


def _statuses(found: Figures) -> str:
    return ", ".join(f"{count} {status}" for status, count in found["statuses"].items())


def _http(found: Figures) -> list[list[str]]:
    wall = found["wall"]["joint to pose"]
    return [
        [
            "`POST /optimize`, pose from a known start, all branches and windings, over HTTP",
            "p50 ≤ 100 ms, p95 ≤ 250 ms",
            ms(wall),
            verdict(wall["p50"] <= 0.100 and wall["p95"] <= 0.250),
            spread_of(wall, 1e3, "ms", 0),
        ]
    ]


def _starts(found: Figures) -> list[list[str]]:
    warm, cold = found["warm"], found["cold"]
    meanwhile = cold["wall_meanwhile"]
    return [
        [
            "first request after a start, warm cache",
            "≤ 1 s",
            f"{warm['first_after_ready']:.2f} s once ready",
            verdict(warm["first_after_ready"] <= 1.0),
            f"ready {warm['start_to_ready']:.1f} s after the start of the process; a request sent before that is "
            f"answered {warm['start_to_answer']:.1f} s after the start",
        ],
        [
            "first request after a start, cold cache (nothing compiled)",
            "≤ 20 s, answered meanwhile",
            f"{cold['start_to_answer']:.1f} s from the start of the process",
            verdict(cold["start_to_answer"] <= 20.0 and cold["all_answered"]),
            f"compiled {_seconds(cold['compiled_after'])} after the start, until then "
            f"{cold['answered_meanwhile']} requests answered, {ms(meanwhile)}; then {ms(cold['wall_afterwards'])}",
        ],
    ]


def _seconds(value: float | None) -> str:
    return "not" if value is None else f"{value:.1f} s"


def _success(found: Figures) -> list[list[str]]:
    gap = found["gap"]
    refusals = ", ".join(f"{count} {kind}" for kind, count in found["refusals"].items()) or "none"
    return [
        [
            f"{found['count']} random feasible requests answered, certificate valid",
            "≥ 99.9 %",
            f"{found['share']:.2%}",
            verdict(found["share"] >= 0.999),
            f"refused: {refusals}; faults found in answers: {len(found['faults'])}",
        ],
        [
            "proven gap, 1 - lower bound / energy",
            "median ≤ 10 %, p90 ≤ 22 %",
            f"median {gap['p50']:.1%}, p90 {gap['p90']:.1%}",
            verdict(gap["p50"] <= 0.10 and gap["p90"] <= 0.22),
            "; ".join(
                f"{kind}: median {each['p50']:.1%}, p90 {each['p90']:.1%}, most {each['most']:.1%}"
                for kind, each in found["gaps"].items()
            ),
        ],
        [
            "no baseline within limits spends less, energy identity, replay of limits and ends",
            "all answers",
            f"{found['valid']} of {found['answered']}",
            verdict(not found["faults"]),
            f"energy identity within {found['identity']:.0e} of the total",
        ],
        [
            "B-spline's energy over the time-scaled line's, same duration",
            "≤ 1 %",
            f"at most {found['relative_excess']:+.2%}",
            verdict(found["relative_excess"] <= 0.01),
            f"{found['compared']} compared",
        ],
    ]


def _quality(found: Figures) -> list[list[str]]:
    excess, fine = found["excess"], found["fine_excess"]
    return [
        [
            f"energy above the best of {found['starts']} starts on {found['control_points']} control points",
            "≤ 1 % on 95 % of tasks, ≤ 3 % on all",
            f"{found['within_one_percent']:.0%} within 1 %, most {excess['most']:+.2%}",
            verdict(found["within_one_percent"] >= 0.95 and found["within_three_percent"] == 1.0),
            f"{_excess(excess)}; above the same polished on {found['fine_control_points']} points: {_excess(fine)}",
        ]
    ]


def _excess(spread: Figures) -> str:
    return f"median {spread['p50']:+.2%}, p95 {spread['p95']:+.2%}, n = {spread['count']}"


def _service(found: Figures) -> list[list[str]]:
    wall, burst = found["wall"], found["burst"]
    ratio = wall["p99"] / wall["p50"]
    errors = sum(count for status, count in found["statuses"].items() if status != "200") + len(found["lost"])
    flat = found["memory_last"] <= 1.05 * found["memory_first"] and found["same_workers"]
    bounded = set(burst["statuses"]) <= {"200", "503"} and "503" in burst["statuses"] and burst["refusals_say_when"]
    return [
        [
            f"{found['clients']} clients for {found['seconds']:.0f} s",
            "no error, queue bounded, memory flat, p99 ≤ 4 × p50",
            f"{errors} errors in {found['answers']} answers, p99 {wall['p99'] * 1e3:.0f} ms = {ratio:.1f} × p50",
            verdict(not errors and ratio <= 4 and flat and bounded),
            f"p50 {wall['p50'] * 1e3:.0f} ms, {found['per_second']:.0f} answers per second by {found['cores']} cores",
        ]
    ]


JUDGES = (
    ("solver", _solver),
    ("http", _http),
    ("scenes", _scenes),
    ("starts", _starts),
    ("success", _success),
    ("quality", _quality),
    ("load", _service),
)


def _requests(figures: dict[str, Figures | None]) -> str:
    rows, notes = [], []
    for section, name in (("http", "one client"), ("success", "two clients")):
        found = figures.get(section)
        if found is None:
            continue
        for kind, wall in found["wall"].items():
            if wall["count"]:
                rows.append([f"{kind}, {name}", ms(wall), spread_of(wall, 1e3, "ms", 0)])
        notes += [f"- refused: {line}" for line in found["refused"]] + [f"- fault: {line}" for line in found["faults"]]
    if not rows:
        return ""
    text = "## Requests\n\n" + table(["requests", "wall time over HTTP", "spread"], rows)
    return text + ("\n\n" + "\n".join(notes) if notes else "")


def _load(found: Figures | None) -> str:
    if found is None:
        return ""
    burst = ", ".join(f"{count} with {status}" for status, count in sorted(found["burst"]["statuses"].items()))
    return (
        "## Load\n\n"
        f"Each of {found['clients']} clients sends its next request as soon as the last is answered, so that "
        f"{found['most_under_way']} are under way at all times on {found['cores']} workers. Resident memory of the "
        f"service's processes, sum: {found['memory_first']:.0f} MiB in the second quarter of the time, "
        f"{found['memory_last']:.0f} MiB in the last. {found['burst']['sent']} requests at once: {burst}, the refusals "
        "with `Retry-After`."
    )


def _scaling(found: Figures | None) -> str:
    if found is None:
        return ""
    points, joints, candidates = (found[name] for name in ("control_points", "joints", "candidates"))
    text = "## Growth\n\n"
    text += f"Exponents are of medians, by a straight line through their logarithms; {found['count']} tasks a row.\n\n"
    text += _growth("Control points, one programme, evenly spaced knots", points) + "\n\n"
    text += table(
        ["control points", "nodes", "time", "iterations", "solved"],
        (
            [f"{row['size']}", f"{row['nodes']}", ms(row["wall"], 1), f"{row['iterations']['p50']:.0f}", _share(row)]
            for row in points["rows"]
        ),
    )
    text += "\n\n" + _growth("Degrees of freedom, one candidate, the chain cut short or made longer", joints) + "\n\n"
    text += table(
        ["joints", "time", "iterations", "solved"],
        (
            [f"{row['size']}", ms(row["wall"], 1), f"{row['iterations']['p50']:.0f}", _share(row)]
            for row in joints["rows"]
        ),
    )
    text += "\n\n" + _growth("Candidates, one whole answer", candidates, False) + "\n\n"
    text += table(
        ["what is allowed", "candidates", "time", "programmes solved"],
        (
            [row["name"], f"{row['size']:.0f}", ms(row["wall"]), f"{row['iterations']['p50']:.0f}"]
            for row in candidates["rows"]
        ),
    )
    return text


def _growth(what: str, found: Figures, iterations: bool = True) -> str:
    text = f"**{what}**: time grows with the power {found['exponent']:.1f}"
    return text + (f", that of an iteration with {found['exponent_per_iteration']:.1f}." if iterations else ".")


def _share(row: Figures) -> str:
    return f"{row['solved']} of {row['wall']['count']}"
