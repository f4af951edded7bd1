"""The report of a log: measured and predicted energy of every move."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.report.assumptions import assumptions, interval_note
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.drawings import Bar, drawn_bars
from joulepath.app.api.report.numbers import (
    digits,
    down,
    interval_of,
    percent,
    share,
    unbroken,
    up,
)
from joulepath.app.api.report.report import Fact, Report, Rival, Table
from joulepath.app.api.report.rivals import listed, parts_of
from joulepath.app.convert.given_answer import arm_of
from joulepath.optimizer.dynamics.losses import ENERGY_FLOOR

Json = dict[str, Any]
_BY = {"electrical": "power", "by_efforts": "currents or torques"}
_SOURCES = {
    "electrical": "Energy measured from power is the integral of the power of the arm's bus.",
    "by_efforts": "Energy measured from currents or torques is the sum of shaft work, losses of "
    "the robot's drives and idle power.",
}


def log_report(bundle: Bundle) -> Report:
    """The report of the evaluation of a log."""
    answer, arm = bundle.answer, arm_of(bundle.request, bundle.answer)
    total, segments = answer["total"], answer["segments"]
    moves = [(k, each) for k, each in enumerate(segments, 1)]
    electrical = total["energy"]["electrical"]
    told = "yours" if "payload" in bundle.request else "from the log"
    name = ((bundle.log or {}).get("settings") or {}).get("name")
    return Report(
        title=bundle.title or name or "Energy of a log",
        subtitle=bundle.subtitle(arm.robot),
        lead=tuple(map(unbroken, _lead(answer))),
        facts=_facts(answer),
        picture="",
        caption="",
        rivals_title="Measured and predicted energy",
        rivals=_bars(total),
        rivals_note="90 % interval: from the 5th to the 95th percentile of the prediction.",
        parts=parts_of(electrical),
        course_title="Energy of each move and rest",
        course_note="In J: bars with 90 % intervals are predicted, dots are measured.",
        course=drawn_bars([_bar(k, each) for k, each in moves]),
        costs=(),
        currency="",
        costs_note="",
        proven_title="Sources of the energies",
        proven=unbroken(_compared(answer)),
        check=bundle.how_to_check(None),
        assumptions=assumptions(bundle.request, None, arm.robot, [arm.payload.mass], told),
        assumptions_note=unbroken(interval_note(electrical.get("interval"))),
        foot=f"Predicted energies: joulepath {bundle.version}. Measured energies: from the log.",
        table=_table(moves, total),
    )


def measured(part: Json) -> tuple[str, float] | None:
    """Source and value [J] of the most direct measurement of a part of a log; None without any."""
    known = part["measured"] or {}
    return next(((by, known[by]) for by in _BY if known.get(by) is not None), None)


def _within(part: Json) -> bool | None:
    """Whether the measured energy lies in the interval of the prediction; None if unknown."""
    found, likely = measured(part), part["energy"]["electrical"].get("interval")
    if found is None or likely is None:
        return None
    return bool(likely["p5"] <= found[1] <= likely["p95"])


def _more(difference: float) -> str:
    return f"{percent(abs(difference))} {'more' if difference >= 0 else 'less'}"


def _lead(answer: Json) -> tuple[str, ...]:
    total, segments = answer["total"], answer["segments"]
    electrical, found = total["energy"]["electrical"], measured(total)
    interval = interval_of(electrical.get("interval")).removeprefix(", ")
    predicted = f"*{digits(electrical['total'])} J*" + (f" ({interval} J)" if interval else "")
    length = f"{digits(answer['duration'])} s"
    if found is None:
        return (
            f"The logged motion takes {length}, and its predicted energy is {predicted}.",
            "The log contains no power, currents or torques, so there is no measured energy.",
        )
    difference = total["difference"]
    compared = "compared with" if difference is None else f"*{_more(difference)}* than"
    inside = [within for within in map(_within, segments) if within is not None]
    return (
        f"In {length}, the arm drew *{digits(found[1])} J* according to the logged "
        f"{_BY[found[0]]}, {compared} the predicted {predicted}.",
        f"The measured energies of {sum(inside)} of {len(inside)} moves and rests lie within their "
        "90 % intervals; nine of ten are expected."
        if inside
        else "",
    )


def _facts(answer: Json) -> tuple[Fact, ...]:
    total = answer["total"]
    electrical, found = total["energy"]["electrical"], measured(total)
    predicted = f"predicted{interval_of(electrical.get('interval'))}"
    facts = [Fact(digits(electrical["total"]), "J", predicted)]
    if found is not None:
        facts.insert(0, Fact(digits(found[1]), "J", f"measured from {_BY[found[0]]}"))
    if total["difference"] is not None:
        sign = "+" if total["difference"] >= 0 else "−"
        share = f"{sign}{100 * abs(total['difference']):.1f}"
        facts.append(Fact(share, "%", "measured relative to predicted"))
    facts.append(
        Fact(
            f"{answer['segment_count']:,}", "", f"moves and rests in {digits(answer['duration'])} s"
        )
    )
    return tuple(facts)


def _bars(total: Json) -> tuple[Rival, ...]:
    known, predicted = total["measured"] or {}, total["energy"]["electrical"]["total"]
    shown = [
        (f"Measured from {_BY[by]}", value) for by, value in known.items() if value is not None
    ]
    most = max([ENERGY_FLOOR, predicted, *(value for _, value in shown)])

    def rival(name: str, value: float, more: str, ours: bool = False) -> Rival:
        return Rival(name, "", f"{digits(value)} J", max(value, 0.0) / most, more, True, ours=ours)

    measured = (
        rival(name, value, _more(share(value - predicted, predicted))) for name, value in shown
    )
    return rival("Predicted", predicted, "", ours=True), *measured


def _bar(number: int, part: Json) -> Bar:
    found = measured(part)
    dot = None if found is None else found[1]
    return Bar.of(str(number), part["energy"]["electrical"], dot)


def _compared(answer: Json) -> str:
    known = answer["total"]["measured"] or {}
    sentences = [text for by, text in _SOURCES.items() if known.get(by) is not None]
    sentences.append(
        "Predicted energy is computed from the logged positions over time and the listed "
        "assumptions, without any measured energy."
    )
    broken = [each["limit"] for each in answer["limits"] if not each["held"]]
    if broken:
        sentences.append(f"The logged motion exceeds its limits of {listed(broken)}.")
    return " ".join([*sentences, *answer["warnings"]])


def _table(moves: list[tuple[int, Json]], total: Json) -> Table:
    return Table(
        title="Moves and rests",
        note="Interval: from the 5th to the 95th percentile of the prediction. Difference: "
        "measured relative to predicted.",
        head=(
            "no.",
            "start, s",
            "duration, s",
            "measured, J",
            "predicted, J",
            "interval, J",
            "difference",
            "in interval",
        ),
        rows=(*(_cells(str(k), part) for k, part in moves), _cells("all", total)),
        words=1,
    )


def _cells(name: str, part: Json) -> tuple[str, ...]:
    electrical, found = part["energy"]["electrical"], measured(part)
    known, difference, within = electrical.get("interval"), part["difference"], _within(part)
    return (
        name,
        f"{part['start']:.2f}",
        f"{part['end'] - part['start']:.2f}",
        "–" if found is None else digits(found[1]),
        digits(electrical["total"]),
        "" if known is None else f"{down(known['p5'])} to {up(known['p95'])}",
        "–" if difference is None else f"{100 * difference:+.1f} %".replace("-", "−"),
        "" if within is None else ("yes" if within else "no"),
    )
