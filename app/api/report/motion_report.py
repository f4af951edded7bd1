"""The report of a motion or a cycle. It only computes sums, shares and costs."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.report.assumptions import assumptions, interval_note
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.costs import (
    Money,
    advice_note,
    advice_table,
    cost_table,
    costs_note,
    cycle_time,
    facts,
    waiting,
)
from joulepath.app.api.report.drawings import Course, Leg, Stop, drawn
from joulepath.app.api.report.numbers import counted, digits, down, percent, share, unbroken, up
from joulepath.app.api.report.report import Report, Rival
from joulepath.app.api.report.rivals import (
    REPORT,
    above_least,
    limits_used,
    nearest_rival,
    parts_of,
    rival_name,
    saved,
    their_energy,
)
from joulepath.optimizer.dynamics.losses import ENERGY_FLOOR
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.picture.cell_picture import cell_picture, stops_of

LEGS_NOTE = (
    "Bars are legs: width shows duration, height mean power, number energy in J; filled bars carry "
    "a part. Curve: supply power."
)
"""Explanation of a drawing with legs."""


def motion_report(bundle: Bundle, program: Program) -> Report:
    """The report of documents with the motions of `program`."""
    answer, money = bundle.answer, Money.of(bundle)
    masses = [move.arm.payload.mass for move in program.moves]
    course = course_of(bundle, program)
    several = len(course.legs) > 1
    return Report(
        title=bundle.title or f"Energy of a {bundle.what}",
        subtitle=bundle.subtitle(program.robot),
        lead=tuple(map(unbroken, _lead(bundle))),
        facts=facts(bundle, money),
        picture=cell_picture(program),
        caption=_caption(program),
        rivals_title="Comparison with baselines",
        rivals=_rivals(bundle),
        rivals_note=_rivals_note(bundle),
        parts=parts_of(answer["energy"]["electrical"]),
        course_title=f"Power over the {bundle.what}",
        course_note=LEGS_NOTE if several else "Drawn from the supply, in W.",
        course=drawn(course),
        costs=cost_table(bundle, money),
        currency=money.currency,
        costs_note=costs_note(money),
        proven_title="Certificate",
        proven=unbroken(proven(answer)),
        check=bundle.how_to_check(answer.get("id")),
        assumptions=assumptions(
            bundle.request,
            bundle.costs,
            program.robot,
            masses,
            period=bundle.period if waiting(bundle) else None,
        ),
        assumptions_note=unbroken(interval_note(answer["energy"]["electrical"].get("interval"))),
        changes=advice_table(bundle, money),
        changes_note=unbroken(advice_note(bundle)),
        foot=bundle.foot,
    )


def _caption(program: Program) -> str:
    place, path = "at the goal", "the path of the TCP"
    if len(program.moves) > 1:
        place = "at the end of the first move"
        if any(move.arm.payload.mass > 0 for move in program.moves):
            place = "where it puts down the first part"
            path += " (solid with a part, dashed without)"
    return (
        f"The bodies of the collision check: the arm {place}, the arm at the start (pale), and "
        f"{path}."
    )


def _lead(bundle: Bundle) -> tuple[str, ...]:
    answer = bundle.answer
    objective, word = answer["objective"], bundle.what
    total, bound = answer["energy"][objective]["total"], answer["energy"]["lower_bound"]
    stops = f" of {counted(len(answer['order']), 'stop')}" if bundle.kind == "cycle" else ""
    kind = "" if objective == "electrical" else " of mechanical work"
    length = cycle_time(bundle)
    waits = length > answer["duration"] and objective == "electrical"
    wait, within = f", including the wait until {digits(length)} s" if waits else "", ""
    if held := waiting(bundle):
        within = " in this time"
        wait = f" and, with the wait until {digits(length)} s, *{digits(total + held)} J*"
    first = (
        f"One {word}{stops} needs *{digits(total)} J{kind}* in {digits(answer['duration'])} s{wait}"
    )
    best = nearest_rival(answer, length if length > answer["duration"] else None)
    if best is None:
        claim = f". No baseline keeps every limit{within}, so no saving is claimed."
    elif best["saving"] < -REPORT.equal:
        more = percent(-_share(answer, best, held))
        claim = (
            f": {more} more than {_words(best)}. Changes that save energy are listed below."
            if held
            else f". With a wait until {digits(best['duration'])} s, it needs {more} more than "
            f"{_words(best)}: request a {word} of this duration."
        )
    elif best["saving"] < REPORT.equal:
        claim = f", as much as {_words(best)}."
    else:
        less = percent(_share(answer, best, held))
        claim = f": *{less} less* than {_words(best)}.{_yearly(bundle, best)}"
    return first + claim, above_least(f"No {word} for this task", total, bound)


def _saved(answer: dict[str, Any], rival: dict[str, Any]) -> float:
    """Saving over a rival [J], in the time of the longer motion."""
    objective, saving = answer["objective"], float(rival["saving"])
    if rival["duration"] > answer["duration"]:
        return saving * abs(float(rival[objective]))
    ours = float(answer["energy"][objective]["total"])
    return their_energy(ours, saving) - ours


def _share(answer: dict[str, Any], rival: dict[str, Any], held: float) -> float:
    """The saving as a share of the rival's energy, with a wait of `held` [J] for our motion."""
    if not held:
        return float(rival["saving"])
    saved = _saved(answer, rival)
    return share(saved, float(answer["energy"][answer["objective"]]["total"]) + held + saved)


def _yearly(bundle: Bundle, rival: dict[str, Any]) -> str:
    """Saving per year, as a sentence; empty without the number of shifts."""
    money = Money.of(bundle)
    if bundle.answer["objective"] != "electrical" or money.shifts is None:
        return ""
    joules = _saved(bundle.answer, rival) * money.cycles * money.shifts
    return f" This saves {money.in_words(joules)} per year."


def _words(rival: dict[str, Any]) -> str:
    return f"the best baseline within all limits (“{rival_name(rival)}”) in the same time"


def _rivals(bundle: Bundle) -> tuple[Rival, ...]:
    """The answer, then its rivals; rivals within the limits precede the others."""
    answer = bundle.answer
    objective = answer["objective"]
    total = answer["energy"][objective]["total"]
    table = sorted(answer["baselines"], key=lambda each: (each["saving"] is None, each[objective]))
    most = max(total, *(each[objective] for each in table), ENERGY_FLOOR)
    return (
        Rival(
            f"This {bundle.what}",
            f"{digits(answer['duration'])} s",
            f"{digits(total)} J",
            max(total / most, 0.0),
            "",
            True,
            ours=True,
        ),
        *(
            Rival(
                rival_name(each),
                f"{digits(each['duration'])} s",
                f"{digits(each[objective])} J",
                max(each[objective] / most, 0.0),
                _broken(each) if each["saving"] is None else saved(each["saving"]),
                each["saving"] is not None,
                saves=(each["saving"] or 0.0) >= REPORT.equal,
            )
            for each in table
        ),
    )


def _broken(rival: dict[str, Any]) -> str:
    """Why no saving is claimed, in two words."""
    moves = rival.get("broken", [rival])
    reasons = [each for move in moves for each in (move.get("reason") or "").split("; ")]
    return "collides" if all("closer than" in each for each in reasons) else "exceeds a limit"


def _rivals_note(bundle: Bundle) -> str:
    length = cycle_time(bundle)
    best = nearest_rival(bundle.answer, length if length > bundle.answer["duration"] else None)
    rule = (
        "Savings are claimed only against baselines within all limits. The faster motion waits for "
        "the slower one; its wait is included. Hatched: no claim."
    )
    known = None if best is None else best.get("saving_interval")
    if known is None:
        return rule
    name = "" if best is None else rival_name(best)
    low, high = percent(known["p5"], "down"), percent(known["p95"], "up")
    return f"90 % interval of the saving against “{name}”: {low} to {high}. {rule}"


def course_of(bundle: Bundle, program: Program) -> Course:
    """The power over time of a motion or a cycle, with its legs."""
    answer = bundle.answer
    if bundle.kind == "optimize":
        trajectory, wait = answer["trajectory"], float(answer["energy"]["electrical"]["dwell"])
        t, power = list(trajectory["t"]), list(trajectory["power"])
        dwell = (bundle.request.get("dwell") or {}).get("time")
        if wait > 0 and dwell is not None and dwell > answer["duration"]:
            mean = wait / (dwell - answer["duration"])
            t, power = [*t, t[-1], dwell], [*power, mean, mean]
        return Course(t[-1], t, power)
    moves, legs, t, power = iter(bundle.moves), list[Leg](), list[float](), list[float]()
    for leg in answer["legs"]:
        rests = leg["kind"] in ("dwell", "wait")
        move = None if rests else next(moves)
        # a tool with a mass is no part in hand
        loaded = move is not None and move["arm"]["payload"] is not None
        legs.append(Leg(leg["t0"], leg["duration"], leg["electrical"], rests, loaded))
        if move is None:
            mean = leg["electrical"] / leg["duration"]
            t += [leg["t0"], leg["t0"] + leg["duration"]]
            power += [mean, mean]
        else:
            trajectory = move["trajectory"]
            t += [leg["t0"] + each for each in trajectory["t"]]
            power += trajectory["power"]
    stops = [Stop(each.t, each.number, each.takes) for each in stops_of(program)]
    return Course(answer["duration"], t, power, legs, stops)


def proven(answer: dict[str, Any]) -> str:
    """Statements of the certificate of an answer, in sentences."""
    used = limits_used(answer["certificate"]["worst_ratio"])
    sentences = [f"All limits are kept. {used}"]
    clearance = answer["certificate"].get("clearance")
    if clearance is not None:
        one, other = (name.replace("_", " ") for name in clearance["pair"])
        left = 1e3 * clearance["min_clearance"]
        sentences.append(
            f"The nearest bodies, {one} and {other}, keep at least {down(left, 2)} mm more than "
            "the required clearance at every instant."
        )
    else:
        sentences.append("Collisions were not checked.")
    error = answer["certificate"]["energy_error"]
    sentences.append(
        "A computation with Pinocchio, independent of the solver, gives the same energy within "
        f"{up(100 * error, 1)} %."
    )
    return " ".join(sentences)
