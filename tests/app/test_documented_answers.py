"""Numbers printed beside a request in the documentation equal the service's answer to it."""

from __future__ import annotations

import json
import re
from functools import cache
from typing import Any

import pytest

from tests.app.live import ROOT, Server
from tests.app.requests import PATIENT
from tests.selection import long_but

ENERGY = 5e-3
"""Relative: the last digits of an optimum depend on the processor and on the compiler of the
kernel.
"""
SHARE = 0.5
"""[%] of a gap or a saving, for the same reason."""

BUSES: dict[str, dict[str, Any]] = {
    "isolated": {"mode": "isolated"},
    "shared": {"mode": "shared"},
    "recuperating": {"mode": "recuperating", "efficiency": 0.9},
}
TOTAL = "energy/electrical/total"
BOUND = "energy/lower_bound"
GAP = "energy/optimality_gap"
# page, pattern of the number, path and file of the request, changes of it, and the stated field
SAID: list[tuple[str, str, str, dict[str, Any], str]] = [
    ("README.md", r"at most ([\d.]+) % above the least", "optimize/paper_pose_1", {}, GAP),
    (
        "docs/reference/optimize.md",
        r"at most ([\d.]+) % above the least",
        "optimize/pose_to_pose",
        {},
        GAP,
    ),
    (
        "docs/reference/collisions.md",
        r"The motion needs ([\d.]+) J",
        "optimize/bin_to_shelf",
        {},
        TOTAL,
    ),
    (
        "docs/reference/collisions.md",
        r"it needs ([\d.]+) J",
        "optimize/bin_to_shelf",
        {"collisions": False},
        TOTAL,
    ),
    (
        "docs/reference/evaluate.md",
        r'"nearest": \{"distance": ([\d.]+)',
        "evaluate/paper_motion_1",
        {},
        "nearest/distance",
    ),
    (
        "docs/reference/whatif.md",
        r"base needs ([\d.]+) J",
        "whatif/lighter_arm",
        {},
        "base/electrical/total",
    ),
    *(
        (
            "docs/reference/drives.md",
            rf"\| `{name}`.*? \| [\d.]+ \| ([\d.]+) \|",
            "optimize/storage_on_the_bus",
            {"bus": bus},
            TOTAL,
        )
        for name, bus in BUSES.items()
    ),
    *(
        (
            "docs/reference/targets.md",
            rf"\| {row} \| .*? \| {number} \|",
            f"optimize/paper_position_{row}",
            {},
            field,
        )
        for row in (1, 2, 3)
        for number, field in (
            (r"([\d.]+) \| [\d.]+ \| optimal", TOTAL),
            (r"[\d.]+ \| ([\d.]+) \| optimal", BOUND),
        )
    ),
    (
        "docs/reference/tool_paths.md",
        r"a seam of 0.4 m needs ([\d.]+) J",
        "optimize/seam_any_turn",
        {},
        TOTAL,
    ),
    (
        "docs/explained/cycles.md",
        r"along lines: the cycle needs ([\d.]+) J",
        "cycle/round_parts",
        {},
        TOTAL,
    ),
    (
        "docs/explained/cycles.md",
        r"a seam of 0.4 m: the cycle needs ([\d.]+) J",
        "cycle/seam_any_turn",
        {},
        TOTAL,
    ),
]
SLOW = {"optimize/seam_any_turn", "cycle/round_parts", "cycle/seam_any_turn"}
# one bus and one position stand for all
FURTHER = {"optimize/paper_position_2", "optimize/paper_position_3"}
FURTHER_BUSES = (BUSES["isolated"], BUSES["shared"])
QUICK = [
    row for row in SAID if row[2] not in SLOW | FURTHER and row[3].get("bus") not in FURTHER_BUSES
]
# pages with a shortened answer, and its request
SHOWN = {
    "README.md": "optimize/paper_pose_1",
    "docs/reference/optimize.md": "optimize/pose_to_pose",
    "docs/reference/targets.md": "optimize/free_orientation",
}


@cache
def computed(server: Server, request: str, changes: str) -> dict[str, Any]:
    path, body = request.split("/")[0], json.loads((ROOT / f"examples/{request}.json").read_text())
    patient = {} if path == "evaluate" else PATIENT
    return server.post(f"/{path}", patient | body | json.loads(changes)).json()


def answer_to(server: Server, request: str, changes: dict[str, Any]) -> dict[str, Any]:
    """The answer to an example with changes, computed once for all that is said of it."""
    return computed(server, request, json.dumps(changes))


def stated(page: str, pattern: str) -> float:
    """The only number on a page found by the pattern, across line breaks."""
    (number,) = re.findall(pattern.replace(" ", r"\s+"), (ROOT / page).read_text())
    return float(number)


@pytest.mark.parametrize(
    ("page", "pattern", "request_file", "changes", "field"),
    long_but(QUICK, SAID),
)
def test_a_number_in_the_text(
    server: Server, page: str, pattern: str, request_file: str, changes: dict[str, Any], field: str
) -> None:
    found: Any = answer_to(server, request_file, changes)
    for name in field.split("/"):
        found = found[name]
    if "%" in pattern:
        assert stated(page, pattern) == pytest.approx(100 * found, abs=SHARE)
    else:
        assert stated(page, pattern) == pytest.approx(found, rel=ENERGY)


@pytest.mark.parametrize(("page", "request_file"), SHOWN.items())
def test_a_shortened_answer(server: Server, page: str, request_file: str) -> None:
    answer = answer_to(server, request_file, {})
    assert re.findall(r'"duration": [\d.]+,\s"status": "(\w+)"', (ROOT / page).read_text()) == [
        answer["status"]
    ]
    assert stated(page, r'"electrical": \{"total": ([\d.]+)') == pytest.approx(
        answer["energy"]["electrical"]["total"], rel=ENERGY
    )
    assert stated(page, r'"lower_bound": [\d.]+, "optimality_gap": ([\d.]+)') == pytest.approx(
        answer["energy"]["optimality_gap"], abs=SHARE / 100
    )


def test_what_the_limitations_say_of_mechanical_work(server: Server) -> None:
    answer = answer_to(server, "optimize/mechanical_fixed_duration", {})
    counts = answer["candidate_counts"]
    text = " ".join((ROOT / "docs/reference/limitations.md").read_text().split())
    assert (
        f"{counts['infeasible']} of 256 take too long, bounds rule out {counts['pruned']}, one is "
        "solved" in text
    )
    assert answer["status"] == "feasible"
    assert f"here it is {100 * answer['energy']['optimality_gap']:.0f} %" in text


@pytest.mark.long
def test_the_table_of_the_front(server: Server) -> None:
    answer = answer_to(server, "pareto/branch_switch", {})
    rows = re.findall(
        r"^\| ([\d.]+) \| ([\d.]+) \| `([\w/]+)` .* `(\w+)` \|$",
        (ROOT / "docs/reference/pareto.md").read_text(),
        re.M,
    )
    assert [(goal, status) for _, _, goal, status in rows] == [
        (p["goal"], p["status"]) for p in answer["points"]
    ]
    for column, field in enumerate(("duration", "energy")):
        assert [float(row[column]) for row in rows] == pytest.approx(
            [p[field] for p in answer["points"]], rel=ENERGY
        )
