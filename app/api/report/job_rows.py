"""The rows of a job and their sums, as the documents of a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from joulepath.app.api.report.rivals import nearest_rival, their_energy

Json = dict[str, Any]
_LEFT_OUT = frozenset({"candidates", "limits", "branch", "unreachable", "solver"})
_SAMPLED = ("t", "q", "v", "a", "tau")


def row_of(row: Json) -> Json:
    """A row of `job_document` without the samples of its motion but three."""
    answer = row["answer"]
    if answer is not None:
        answer = {key: value for key, value in answer.items() if key not in _LEFT_OUT}
        trajectory = answer.get("trajectory")
        if trajectory is not None:
            last = len(trajectory["t"]) - 1
            thin = {key: [trajectory[key][k] for k in (0, last // 2, last)] for key in _SAMPLED}
            answer["trajectory"] = thin | {"spline": trajectory["spline"]}
    return row | {"answer": answer}


def answered(rows: Sequence[Json]) -> list[Json]:
    """The rows with an energy: motions and cycles."""
    return [row for row in rows if "lower_bound" in ((row["answer"] or {}).get("energy") or {})]


def summed(rows: Sequence[Json]) -> Json:
    """Sum of energy and duration over all answered rows, times the `weight` of a row if given.

    The ends of the interval are the sums of the ends. They are exact if all energies are too large
    or too small together, and otherwise too wide.
    """
    given = answered(rows)
    weights = [row.get("weight", 1.0) for row in given]
    electrical = [row["answer"]["energy"]["electrical"] for row in given]
    names = {name for each in electrical for name, value in each.items() if _is_number(value)}

    def total(values: Iterable[float]) -> float:
        pairs = zip(weights, values, strict=True)
        return float(sum(weight * value for weight, value in pairs))

    parts = {name: total(each.get(name) or 0.0 for each in electrical) for name in sorted(names)}
    known = [each["interval"] for each in electrical]
    return {
        "duration": total(row["answer"]["duration"] for row in given),
        "energy": {
            "electrical": parts | {"interval": _together(known, weights)},
            "lower_bound": total(row["answer"]["energy"]["lower_bound"] for row in given),
        },
    }


def _together(known: Sequence[Json | None], weights: Sequence[float]) -> Json | None:
    if not known or None in known:
        return None
    intervals = [
        each | {end: weight * each[end] for end in ("p5", "p95")}
        for each, weight in zip(known, weights, strict=True)
        if each is not None
    ]
    widths = [each["p95"] - each["p5"] for each in intervals]
    shares = dict[str, float]()
    for each, width in zip(intervals, widths, strict=True):
        for name, share in each["shares"].items():
            shares[name] = shares.get(name, 0.0) + share * width / sum(widths)
    ends = {end: sum(each[end] for each in intervals) for end in ("p5", "p95")}
    return ends | {"shares": shares}


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def rivals_of(rows: Sequence[Json]) -> dict[str, tuple[int, float, float]]:
    """Sums over the rows with a feasible baseline, by the name of the baseline.

    The name `nearest` stands for the baseline of a row with the least saving.

    Returns:
        Number of rows, energy of the baseline [J], and energy of the answers [J], by the name.
    """
    found = dict[str, tuple[int, float, float]]()
    for row in answered(rows):
        answer = row["answer"]
        if answer["objective"] != "electrical":
            continue
        ours = answer["energy"]["electrical"]["total"]
        claimed = [each for each in answer["baselines"] if each["saving"] is not None]
        nearest = nearest_rival(answer)
        named = [(each["name"], each) for each in claimed]
        for name, each in named if nearest is None else [*named, ("nearest", nearest)]:
            count, theirs, own = found.get(name, (0, 0.0, 0.0))
            # at the same time, the shorter of both waits
            found[name] = (count + 1, theirs + their_energy(ours, each["saving"]), own + ours)
    return found
