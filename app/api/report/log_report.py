"""The report of a log: measured and predicted energy of every move."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.report.assumptions import assumptions, interval_note
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.drawings import Bar, drawn_bars
from joulepath.app.api.report.numbers import digits, down, percent, share, unbroken, up
from joulepath.app.api.report.report import Fact, Report, Rival, Table
from joulepath.app.api.report.rivals import listed, parts_of
from joulepath.app.convert.given_answer import arm_of
from joulepath.optimizer.dynamics.losses import ENERGY_FLOOR

Json = dict[str, Any]
_BY = {"electrical": "power", "by_efforts": "currents or torques"}
_SOURCES = {
    "electrical": "Measured energy is the integral of the logged power of the arm's bus.",
    "by_efforts": "Measured energy is computed from the logged currents or torques: shaft work, "
    "the losses of the robot's drives, and its idle power.",
}


def log_report(bundle: Bundle) -> Report:
    """The report of the evaluation of a log."""
    answer, arm = bundle.answer, arm_of(bundle.request, bundle.answer)
    total, segments = answer["total"], answer["segments"]
    moves = [(k, each) for k, each in enumerate(segments, 1)]
    electrical = total["energy"]["electrical"]
    told = "yours" if "payload" in bundle.request else "the log"
    name = ((bundle.log or {}).get("settings") or {}).get("name")
    return Report(
        title=bundle.title or name or "A log",
        subtitle=bundle.subtitle(arm.robot),
        lead=tuple(map(unbroken, _lead(answer))),
        facts=_facts(answer),
        picture="",
        caption="",
        rivals_title="Measured against predicted",
        rivals=_bars(total),
        rivals_note="Likely: from the 5th to the 95th percentile of the prediction.",
        parts=parts_of(electrical),
        course_title="Energy of each move and rest",
        course_note="in J: the bar as predicted, with its interval; the dot as measured",
        course=drawn_bars([_bar(k, each) for k, each in moves]),
        costs=(),
        currency="",
        costs_note="",
        proven_title="What was compared",
        proven=unbroken(_compared(answer)),
        check=bundle.how_to_check(None),
        assumptions=assumptions(bundle.request, None, arm.robot, [arm.payload.mass], told),
        assumptions_note=unbroken(interval_note(electrical.get("interval"))),
        foot=f"Predicted by joulepath {bundle.version}; measured by whoever logged it.",
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
    likely = electrical.get("interval")
    known = "" if likely is None else f" (likely {down(likely['p5'])} to {up(likely['p95'])} J)"
    predicted = f"*{digits(electrical['total'])} J*{known}"
    length = f"{digits(answer['duration'])} s"
    if found is None:
        return (
            f"For the motion of this log, {length} long, {predicted} are predicted.",
            "Neither power nor currents nor torques were logged: nothing is measured.",
        )
    first = (
        f"In {length}, the arm drew *{digits(found[1])} J* by the logged {_BY[found[0]]}; "
        f"{predicted} are predicted"
    )
    difference = total["difference"]
    first += "." if difference is None else f": measured is *{_more(difference)}*."
    inside = [within for within in map(_within, segments) if within is not None]
    return (
        first,
        f"{sum(inside)} of {len(inside)} moves and rests lie within the interval of their "
        "prediction, which should hold nine of ten."
        if inside
        else "",
    )


def _facts(answer: Json) -> tuple[Fact, ...]:
    total = answer["total"]
    electrical, found = total["energy"]["electrical"], measured(total)
    likely = electrical.get("interval")
    known = "" if likely is None else f", likely {down(likely['p5'])} to {up(likely['p95'])}"
    facts = [Fact(digits(electrical["total"]), "J", f"predicted{known}")]
    if found is not None:
        facts.insert(0, Fact(digits(found[1]), "J", f"measured by {_BY[found[0]]}"))
    if total["difference"] is not None:
        sign = "+" if total["difference"] >= 0 else "−"
        share = f"{sign}{100 * abs(total['difference']):.1f}"
        facts.append(Fact(share, "%", "measured beyond predicted"))
    facts.append(
        Fact(
            f"{answer['segment_count']:,}", "", f"moves and rests in {digits(answer['duration'])} s"
        )
    )
    return tuple(facts)


def _bars(total: Json) -> tuple[Rival, ...]:
    known, predicted = total["measured"] or {}, total["energy"]["electrical"]["total"]
    shown = [(f"Measured by {_BY[by]}", value) for by, value in known.items() if value is not None]
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
        "Predicted energy is that of the logged positions over time, with the figures beside; "
        "nothing of the measurement is in it."
    )
    broken = [each["limit"] for each in answer["limits"] if not each["held"]]
    if broken:
        sentences.append(f"The logged motion exceeds its limits of {listed(broken)}.")
    return " ".join([*sentences, *answer["warnings"]])


def _table(moves: list[tuple[int, Json]], total: Json) -> Table:
    return Table(
        title="The moves",
        note="Likely: from the 5th to the 95th percentile of the prediction. Difference: measured "
        "beyond predicted.",
        head=(
            "no.",
            "from, s",
            "s",
            "measured, J",
            "predicted, J",
            "likely, J",
            "difference",
            "within",
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
