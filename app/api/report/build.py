"""From the documents of a report to the report: nothing is computed but sums, shares and costs."""

from __future__ import annotations

from datetime import date
from typing import Any

from joulepath.app.api.report.assumptions import assumptions, interval_note
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.costs import Money, cost_table, costs_note, cycle_time, facts
from joulepath.app.api.report.drawings import Course, Leg, Stop, drawn
from joulepath.app.api.report.numbers import digits, down, percent, unbroken, up
from joulepath.app.api.report.report import Part, Report, Rival
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.picture.cell_picture import cell_picture, stops_of

_PARTS = {
    "friction": ("Friction in the joints", "#e08e2b"),
    "idle": ("Electronics, always on", "#8796a5"),
    "dwell": ("Standing and waiting", "#c3cbd3"),
    "copper": ("Copper of the motors", "#8c3b2a"),
    "potential": ("Lifting", "#3b8fc2"),
    "inverter": ("Inverters", "#b9a24a"),
    "braking": ("Braking resistor", "#b3261e"),
    "kinetic": ("Left in motion", "#5b7fa6"),
    "storage_loss": ("Loss of the storage", "#6c5b7b"),
    "recovered": ("Fed back to the supply", "#14805f"),
}
_RIVALS = {
    "trapezoid": "Trapezoid of speed",
    "quintic": "Smooth polynomial",
    "ruckig": "Fastest motion",
    "ruckig_slowed": "Fastest motion, slowed",
    "straight": "Straight line in joints",
    "controller_default": "Controller's default",
    "stopping": "With a rest at every stop",
    "move_by_move": "Each move by itself",
    "same_factor": "All moves slowed alike",
    "fastest_then_wait": "Fastest cycle, then a wait",
    "given_order": "Stops in the given order",
    "without_storage": "Without the storage",
}
_LEAST_PART = 0.003
"""Least share of the energy with which a part has a line of its own."""
_FULLY = 0.99
_LIMITS = {
    "velocity": "speed",
    "acceleration": "acceleration",
    "jerk": "jerk",
    "torque": "torque",
    "tcp_speed": "speed of the TCP",
    "elbow_speed": "speed of the elbow",
}


def report_of(bundle: Bundle, program: Program) -> Report:
    """The report of documents whose motions are those of `program`."""
    answer, made = bundle.answer, date.fromisoformat(bundle.made)
    money, robot = Money.of(bundle), program.robot
    course = _course(bundle, program)
    several = len(course.legs) > 1
    return Report(
        title=bundle.title or ("A cycle of stops" if bundle.kind == "cycle" else "A motion"),
        subtitle=f"Energy report · {made:%-d %B %Y} · {robot.figures['title']}",
        lead=tuple(map(unbroken, _lead(bundle))),
        facts=facts(bundle, money),
        picture=cell_picture(program),
        caption=_caption(program),
        rivals=_rivals(bundle),
        rivals_note=_rivals_note(bundle),
        parts=_parts(answer["energy"]["electrical"]),
        course_title="The cycle" if several else "The motion",
        course_note="each leg as wide as its time and as high as its mean power, with its joules; "
        "filled with a part in hand. Below, the power from the supply"
        if several
        else "power from the supply over time",
        course=drawn(course),
        costs=cost_table(bundle, money),
        currency=money.currency,
        costs_note=costs_note(money),
        proven=unbroken(_proven(answer)),
        check=_check(answer),
        assumptions=assumptions(bundle, program),
        assumptions_note=unbroken(interval_note(answer["energy"]["electrical"].get("interval"))),
        foot=f"Computed, not measured. Never run on hardware by us. joulepath {bundle.version}",
    )


def _caption(program: Program) -> str:
    shown = "The cell as its collisions are checked: the arm "
    if len(program.moves) == 1:
        return shown + "at the goal, and pale at the start, with the way of the TCP."
    if any(move.arm.payload.mass > 0 for move in program.moves):
        shown += "where the first part is put down, and pale at the start. "
        return shown + "Way of the TCP: in full with a part, dashed without."
    return shown + "at the end of the first move, and pale at the start, with the way of the TCP."


def what(bundle: Bundle) -> str:
    """The thing that the report is on, in a word."""
    return "cycle" if bundle.kind == "cycle" else "motion"


def _lead(bundle: Bundle) -> tuple[str, ...]:
    answer = bundle.answer
    objective, word = answer["objective"], what(bundle)
    total, bound = answer["energy"][objective]["total"], answer["energy"]["lower_bound"]
    stops = f" of {len(answer['order'])} stops" if bundle.kind == "cycle" else ""
    kind = "" if objective == "electrical" else " of mechanical work"
    length = cycle_time(bundle)
    waits = length > answer["duration"] and objective == "electrical"
    wait = f", with the wait until {digits(length)} s" if waits else ""
    first = (
        f"One {word}{stops} needs *{digits(total)} J{kind} in {digits(answer['duration'])} s*{wait}"
    )
    best = _nearest_rival(answer)
    if best is None:
        claim = ". No usual way is known that keeps every limit: no saving is claimed."
    elif best["saving"] < -0.0005:
        more = percent(-best["saving"])
        claim = f", {more} more than {_words(best)}, the wait included: ask for that time."
    elif best["saving"] < 0.0005:
        claim = f", as much as its nearest rival within the limits, {_words(best)}."
    else:
        saved = percent(best["saving"])
        claim = (
            f", which is *{saved} less* than its nearest rival within the limits, {_words(best)}."
        )
    least = (
        f"No {word} of any kind needs less than {down(bound)} J: at most {up(total - bound)} J, "
        f"{percent(max(total - bound, 0.0) / total, 'up')} of it, are left to gain."
        if bound > 0
        else f"How little a {word} could need at least is not known here."
    )
    return first + claim, least


def _words(rival: dict[str, Any]) -> str:
    name = _RIVALS.get(rival["name"], rival["name"])
    return f"“{name}”, in the same time"


def _nearest_rival(answer: dict[str, Any]) -> dict[str, Any] | None:
    """The rival within the limits against which least is saved."""
    claimed = [each for each in answer["baselines"] if each["saving"] is not None]
    return min(claimed, key=lambda each: float(each["saving"]), default=None)


def _rivals(bundle: Bundle) -> tuple[Rival, ...]:
    """The answer, then what it is compared with, those within the limits first."""
    answer = bundle.answer
    objective = answer["objective"]
    total = answer["energy"][objective]["total"]
    table = sorted(answer["baselines"], key=lambda each: (each["saving"] is None, each[objective]))
    most = max(total, *(each[objective] for each in table)) if table else total
    return (
        Rival(
            f"This {what(bundle)}",
            f"{digits(answer['duration'])} s",
            f"{digits(total)} J",
            total / most,
            "",
            True,
            ours=True,
        ),
        *(
            Rival(
                _RIVALS.get(each["name"], each["name"]),
                f"{digits(each['duration'])} s",
                f"{digits(each[objective])} J",
                max(each[objective] / most, 0.0),
                _broken(each) if each["saving"] is None else _saved(each["saving"]),
                each["saving"] is not None,
            )
            for each in table
        ),
    )


def _saved(saving: float) -> str:
    return f"saves {percent(saving)}" if saving >= 0 else f"needs {percent(-saving)} less"


def _broken(rival: dict[str, Any]) -> str:
    """Why no saving is claimed, in two words."""
    reasons = (rival.get("reason") or "").split("; ")
    return "collides" if all("closer than" in each for each in reasons) else "breaks a limit"


def _rivals_note(bundle: Bundle) -> str:
    best = _nearest_rival(bundle.answer)
    rule = (
        "A saving is claimed only against a way that keeps every limit, in the same time: the "
        "shorter of both waits, and its wait is priced. Hatched: no saving."
    )
    known = None if best is None else best.get("saving_interval")
    if known is None:
        return rule
    name = _RIVALS.get(best["name"], best["name"]) if best else ""
    low, high = percent(known["p5"], "down"), percent(known["p95"], "up")
    return f"Against “{name}” the saving is likely {low} to {high}. {rule}"


def _parts(electrical: dict[str, Any]) -> tuple[Part, ...]:
    total = electrical["total"]
    known = {name: float(electrical.get(name) or 0.0) for name in _PARTS}
    shown = {name: value for name, value in known.items() if abs(value) >= _LEAST_PART * abs(total)}
    rest = total - sum(shown.values())
    rows = sorted(shown.items(), key=lambda each: -each[1])
    parts = [Part(*_PARTS[name], *_in_joules(value, total)) for name, value in rows]
    if abs(rest) >= _LEAST_PART * abs(total):
        parts.append(Part("Other", "#e2e7ec", *_in_joules(rest, total)))
    return tuple(parts)


def _in_joules(value: float, total: float) -> tuple[str, str]:
    written = digits(value, 2 if abs(value) < 10 else 3)
    return f"{written} J", f"{value / total:.0%}".replace("%", " %").replace("-", "−")


def _course(bundle: Bundle, program: Program) -> Course:
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
        legs.append(
            Leg(leg["t0"], leg["duration"], leg["electrical"], rests, leg["payload_mass"] > 0)
        )
        if rests:
            mean = leg["electrical"] / leg["duration"]
            t += [leg["t0"], leg["t0"] + leg["duration"]]
            power += [mean, mean]
        else:
            trajectory = next(moves)["trajectory"]
            t += [leg["t0"] + each for each in trajectory["t"]]
            power += trajectory["power"]
    stops = [Stop(each.t, each.number, each.takes) for each in stops_of(program)]
    return Course(answer["duration"], t, power, legs, stops)


def _proven(answer: dict[str, Any]) -> str:
    ratios = {
        name: value
        for name, value in answer["certificate"]["worst_ratio"].items()
        if name in _LIMITS and value is not None
    }
    full = [_LIMITS[name] for name, value in ratios.items() if value >= _FULLY]
    others = [
        f"{_LIMITS[name]} to {value:.0%}".replace("%", " %")
        for name, value in ratios.items()
        if value < _FULLY
    ]
    used = ([f"{_listed(full)} used fully"] if full else []) + others
    sentences = [f"Every limit is kept: {', '.join(used)}."]
    clearance = answer["certificate"].get("clearance")
    if clearance is not None:
        one, other = (name.replace("_", " ") for name in clearance["pair"])
        left = 1e3 * clearance["min_clearance"]
        sentences.append(
            f"Nearest pair: {one} and {other}, at least {down(left, 2)} mm beyond their margin, "
            "proven between the samples too."
        )
    else:
        sentences.append("Collisions were not checked.")
    error = answer["certificate"]["energy_error"]
    sentences.append(
        f"A second program, which shares nothing with the solver but the motion, finds the same "
        f"energy within {up(100 * error, 1)} %."
    )
    return " ".join(sentences)


def _listed(words: list[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def _check(answer: dict[str, Any]) -> str:
    own = f" Answer {answer['id']}." if answer.get("id") else ""
    return (
        "Request and answer are attached to this file. `joulepath check FILE` takes them out, "
        f"certifies every motion again and answers the request anew.{own}"
    )
