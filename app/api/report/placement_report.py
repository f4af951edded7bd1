"""The report of a placement: its map, and the best place against the nominal one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import degrees
from typing import Any

import numpy as np

from joulepath.app.api.report.assumptions import assumptions, interval_note
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.costs import Money, cost_table, costs_note, facts
from joulepath.app.api.report.drawings import Bar, drawn, drawn_bars
from joulepath.app.api.report.job_rows import summed
from joulepath.app.api.report.map_drawing import REASONS, drawn_map
from joulepath.app.api.report.motion_report import LEGS_NOTE, course_of, proven
from joulepath.app.api.report.numbers import digits, down, interval_of, percent, share, unbroken
from joulepath.app.api.report.placed import of_cycle, rows_at
from joulepath.app.api.report.programs import program_of
from joulepath.app.api.report.report import Fact, Report, Rival, Table
from joulepath.app.api.report.rivals import REPORT, above_least, parts_of, saved
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.placement.mounts import yaw_of
from joulepath.optimizer.problem.pose import Pose

Json = dict[str, Any]
MOST_PLACES = 500
"""Most places of the table; a map may have 20,000."""
_COULD = {
    "reach": "a stop is out of reach",
    "collision": "the arm collides",
    "torque": "the torque of a joint is insufficient",
    "time": "the cycle takes too long",
    "motion": "a move has no motion within the limits",
    None: "the deadline left no time",
}


def placement_report(bundle: Bundle) -> Report:
    """Build the report of an answer of `POST /placement`.

    Raises:
        NotCertified: a motion fails its certificate, or its samples differ from its spline.
        InvalidProblem: a part of the request is invalid.
    """
    best = rows_at(bundle, "best")
    programs = [program_of(of_cycle(bundle, row)) for row in best]
    whole = replace(bundle, request={}, answer=summed(best))
    money = Money.of(whole)
    electrical = whole.answer["energy"]["electrical"]
    moves = [move for program in programs for move in program.moves]
    several = len(best) > 1
    return Report(
        title=bundle.title or "Placement of the robot",
        subtitle=bundle.subtitle(programs[0].robot),
        lead=tuple(map(unbroken, _lead(bundle, money))),
        facts=_facts(bundle, whole, money),
        picture=drawn_map(bundle.answer["map"], bundle.answer["best"], bundle.answer["nominal"]),
        caption=unbroken(_caption(bundle.answer)),
        rivals_title="Comparison with other places",
        rivals=_rivals(bundle.answer),
        rivals_note=unbroken(_tolerance(bundle.answer)),
        parts=parts_of(electrical),
        course_title="Energy of each cycle at the best place"
        if several
        else "Power over the cycle at the best place",
        course_note="In J, with 90 % intervals." if several else LEGS_NOTE,
        course=drawn_bars(
            [Bar.of(str(k), row["answer"]["energy"]["electrical"]) for k, row in enumerate(best, 1)]
        )
        if several
        else drawn(course_of(of_cycle(bundle, best[0]), programs[0])),
        costs=cost_table(whole, money),
        currency=money.currency,
        costs_note=costs_note(money),
        proven_title="Certificate of the best place",
        proven=unbroken(" ".join(proven(row["answer"]) for row in best)),
        check=bundle.how_to_check(bundle.answer.get("id")),
        assumptions=assumptions(
            _asked(bundle.request),
            bundle.costs,
            programs[0].robot,
            [move.arm.payload.mass for move in moves],
        ),
        assumptions_note=unbroken(interval_note(electrical.get("interval"))),
        foot=bundle.foot,
        table=_table(bundle.answer),
    )


def _asked(request: Json) -> Json:
    """The first requested cycle."""
    cycle: Json = request.get("cycle") or request["cycles"][0]["cycle"]
    return cycle


def _lead(bundle: Bundle, money: Money) -> tuple[str, ...]:
    answer = bundle.answer
    best, nominal, saving = answer["best"], answer["nominal"], answer["saving"]
    kind = "" if answer["objective"] == "electrical" else " of mechanical work"
    first = (
        f"At the best place found, {_subject(bundle)} *{digits(best['energy'])} J*{kind} "
        f"in {digits(best['duration'])} s"
    )
    if nominal is None:
        first += f". The nominal place has no cycle: {_COULD[answer['nominal_reason']]}."
    elif saving is None or saving < REPORT.equal:
        first += ". The nominal place is equally good."
    else:
        first += f": *{percent(saving)} less* than at the nominal place."
        if money.shifts is not None and answer["objective"] == "electrical":
            yearly = (nominal["energy"] - best["energy"]) * money.cycles * money.shifts
            first += f" This saves {money.in_words(yearly)} per year."
    second = above_least(
        "No cycle at any place of the region", best["energy"], answer["lower_bound"] or 0.0
    )
    return first, second


def _subject(bundle: Bundle) -> str:
    count = len(rows_at(bundle, "best"))
    return f"{count} cycles, multiplied by their weights, need" if count > 1 else "the cycle needs"


def _facts(bundle: Bundle, whole: Bundle, money: Money) -> tuple[Fact, ...]:
    """Figures of the best place; the energy at the nominal place follows as the second."""
    first, *others = facts(whole, money)
    found = [replace(first, words=f"at the best place, {first.words}")]
    nominal = bundle.answer["nominal"]
    if nominal is not None and bundle.answer["objective"] == "electrical":
        known = summed(rows_at(bundle, "nominal"))["energy"]["electrical"]["interval"]
        words = f"at the nominal place{interval_of(known)}"
        found.append(Fact(digits(nominal["energy"]), "J", words))
    return (*found, *others)


def _caption(answer: Json) -> str:
    said = (
        "Map of the region, seen from above. Every point shows the best of all heights there. "
        "The energies are those of certified cycles."
    )
    if answer["left_out"]:
        said += (
            f" {answer['left_out']:,} of {len(answer['map']):,} places were not computed before "
            "the deadline."
        )
    return said


def _rivals(answer: Json) -> tuple[Rival, ...]:
    best, nominal = answer["best"], answer["nominal"]
    known = [each["energy"] for each in answer["map"] if each["energy"] is not None]
    dearest = max([*known, best["energy"], *([] if nominal is None else [nominal["energy"]])])
    others = {"Nominal place": nominal and nominal["energy"], "Worst place of the map": dearest}
    time = {"Nominal place": nominal and f"{digits(nominal['duration'])} s"}
    return (
        Rival(
            "Best place",
            f"{digits(best['duration'])} s",
            f"{digits(best['energy'])} J",
            max(share(best["energy"], dearest), 0.0),
            "",
            True,
            ours=True,
        ),
        *(
            Rival(
                name,
                time.get(name) or "",
                f"{digits(energy)} J",
                max(share(energy, dearest), 0.0),
                saved(saving(best["energy"], energy)),
                True,
                saves=best["energy"] < energy,
            )
            for name, energy in others.items()
            if energy is not None
        ),
    )


def _tolerance(answer: Json) -> str:
    """The best place and its tolerance, in words."""
    said = f"Best place: {_name(answer, answer['best'])}."
    several = len({each["body"] for each in answer["tolerance"]}) > 1
    parts = list[str]()
    for each in answer["tolerance"]:
        name = each["coordinate"]
        body = f" of body {each['body'] + 1}" if several else ""
        ends = f"{_moved(each['lower'], name)} to {_moved(each['upper'], name)}"
        parts.append(f"{ends} in {name}{body}")
    if not parts:
        return f"{said} Its tolerance was not computed."
    return f"{said} The energy rises by at most 2 % for an offset of {', or '.join(parts)}."


def _moved(value: float, coordinate: str) -> str:
    if coordinate == "yaw":
        return f"{degrees(value):+.0f}°".replace("-", "−")
    return f"{1e3 * value:+.0f} mm".replace("-", "−")


def _table(answer: Json) -> Table:
    decided = [each for each in answer["map"] if each["energy"] is not None or each["reason"]]
    places = sorted(
        decided,
        key=lambda each: (each["energy"] is None, each["energy"] or 0.0, each["reason"] or ""),
    )
    return Table(
        title="Places of the map",
        note="Lower bound: no cycles at this place need less."
        + (f" The best {MOST_PLACES} of {len(places):,}." if len(places) > MOST_PLACES else ""),
        head=("place", "J", "lower bound, J"),
        rows=tuple(
            (_name(answer, each), REASONS[each["reason"]][1])
            if each["energy"] is None
            else (
                _name(answer, each),
                digits(each["energy"]),
                "–" if each["lower_bound"] is None else down(each["lower_bound"]),
            )
            for each in places[:MOST_PLACES]
        ),
        words=1,
    )


def _name(answer: Json, place: Json) -> str:
    """A place in words: the poses of the moved bodies."""
    nominal = (answer["nominal"] or answer["best"])["base"]
    moved: Sequence[Json] = place["offsets"]
    if not moved or place["base"] != nominal:
        moved = [place["base"], *moved]
    mount = f", {place['mount']}" if place["mount"] not in (None, "floor") else ""
    return "; ".join(map(_pose, moved)) + mount


def _pose(pose: Json) -> str:
    x, y, z = (f"{1e3 * value:.0f}".replace("-", "−") for value in pose["position"])
    R = Pose.from_quaternion(np.zeros(3), pose["quaternion"]).T[:3, :3]
    yaw = f"{degrees(yaw_of(R)):.0f}".replace("-", "−")
    return f"x {x}, y {y}, z {z} mm" + (f", yaw {yaw}°" if yaw not in ("0", "−0") else "")
