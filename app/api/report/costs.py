"""Costs of a motion or cycle per shift and year, from given numbers only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.numbers import JOULES_PER_KWH, amount, digits, interval_of, percent
from joulepath.app.api.report.report import Change, Cost, Fact

SHIFT = 8 * 3600.0
"""Length of a shift filled with cycles [s], without a given number."""
_CHANGES = {
    "whole_cycle": "Use the whole cycle time",
    "brakes": "Brakes after 0.5 s at rest",
    "without_home": "Omit the start position",
    "shorter_stops": "Dwells 0.1 s shorter",
    "lighter_tool": "Tool of half the mass",
}


@dataclass(frozen=True)
class Money:
    """Given numbers for the conversion of joules into costs, or None."""

    energy: float
    """Of a cycle [J], with its wait, and with the control box if it is counted."""
    likely: dict[str, float] | None
    """Its 5th and 95th percentile `p5` and `p95` [J]."""
    cycles: float
    """Per shift."""
    filled: bool
    """Whether cycles follow one another for a whole shift, because their number is not given."""
    shifts: float | None
    price: float | None
    currency: str
    carbon: float | None
    box: float | None

    def in_words(self, joules: float) -> str:
        """An energy as kilowatt-hours, and as money where its price is given."""
        kwh = joules / JOULES_PER_KWH
        price = "" if self.price is None else f" ({amount(kwh * self.price)} {self.currency})"
        return f"{digits(kwh)} kWh{price}"

    @classmethod
    def of(cls, bundle: Bundle) -> Money:
        """The numbers of a report."""
        costs, answer = bundle.costs, bundle.answer
        electrical, box = answer["energy"]["electrical"], _value(costs, "control_box")
        length = cycle_time(bundle)
        more = (box or 0.0) * length + waiting(bundle)
        known = electrical.get("interval")
        cycles = _value(costs, "cycles_per_shift")
        return cls(
            energy=electrical["total"] + more,
            # how well a wait is known is not computed
            likely=None
            if known is None or waiting(bundle)
            else {end: known[end] + more for end in ("p5", "p95")},
            cycles=SHIFT / length if cycles is None else cycles,
            filled=cycles is None,
            shifts=_value(costs, "shifts_per_year"),
            price=_value(costs, "price"),
            currency=costs.get("currency") or "€",
            carbon=_value(costs, "carbon"),
            box=box,
        )


def cycle_time(bundle: Bundle) -> float:
    """Time [s] from one start to the next: the dwell's, the period, or the duration."""
    dwell = (bundle.request.get("dwell") or {}).get("time")
    period = bundle.period if waiting(bundle) else None
    return max(float(bundle.answer["duration"]), float(dwell or period or 0.0))


def waiting(bundle: Bundle) -> float:
    """Energy [J] of the wait until the end of the period."""
    return float((bundle.advised or {}).get("waiting", 0.0))


def facts(bundle: Bundle, money: Money) -> tuple[Fact, ...]:
    """The leading figures: one cycle, a shift, a year, money."""
    word = bundle.what
    known = bundle.answer["energy"]["electrical"].get("interval")
    total = bundle.answer["energy"]["electrical"]["total"]
    found = [
        Fact(digits(total), "J", f"per {word}{interval_of(known)}{_with_wait(bundle)}"),
        Fact(
            digits(_kwh(money, money.cycles), 2),
            "kWh",
            f"per shift{' of 8 h' if money.filled else ''} ({round(money.cycles):,} {word}s)",
        ),
    ]
    if money.shifts is None:
        return tuple(found)
    yearly = money.cycles * money.shifts
    range_ = interval_of(money.likely, yearly / JOULES_PER_KWH)
    found.append(Fact(digits(_kwh(money, yearly)), "kWh", f"per year{range_}"))
    if money.price is not None:
        carbon = (
            ""
            if money.carbon is None
            else f", with {digits(_kwh(money, yearly) * money.carbon)} kg CO2e"
        )
        cost = _kwh(money, yearly) * money.price
        shown = amount(cost) if cost < 10 else digits(cost, 2)
        found.append(Fact(shown, money.currency, f"per year{carbon}"))
    elif money.carbon is not None:
        found.append(Fact(digits(_kwh(money, yearly) * money.carbon), "kg", "CO2e per year"))
    return tuple(found)


def _with_wait(bundle: Bundle) -> str:
    more = waiting(bundle)
    return f", plus {digits(more)} J of waiting" if more else ""


def advice_table(bundle: Bundle, money: Money) -> tuple[Change, ...]:
    """A row for each change that needs less."""
    given = (bundle.advised or {}).get("advice", ())
    yearly = None if money.shifts is None else money.cycles * money.shifts / JOULES_PER_KWH
    return tuple(
        Change(
            _CHANGES[each["name"]],
            f"{digits(each['energy'])} J",
            f"saves {percent(each['share'])}",
            ""
            if yearly is None
            else f"{amount(each['saving'] * yearly * money.price)} {money.currency} per year"
            if money.price is not None
            else f"{digits(each['saving'] * yearly, 2)} kWh per year",
        )
        for each in given
    )


def advice_note(bundle: Bundle) -> str:
    """How the changes were computed."""
    word = bundle.what
    compared = (
        f"All changes take {digits(cycle_time(bundle))} s. All but the first are compared with the "
        f"{word} of this duration, so that no saving is counted twice."
        if waiting(bundle)
        else f"It is compared with this {word}, for the same number of {word}s per year."
    )
    return f"Each change is optimised separately, not estimated. {compared}"


def cost_table(bundle: Bundle, money: Money) -> tuple[Cost, ...]:
    """A row for a cycle, a shift, and a year if its shifts are given."""
    word = bundle.what
    rows = [(f"1,000 {word}s", 1000.0), ("1 shift", money.cycles)]
    if money.shifts is not None:
        rows.append(("1 year", money.cycles * money.shifts))
    return tuple(
        Cost(
            period,
            digits(_kwh(money, count)),
            "–" if money.price is None else amount(_kwh(money, count) * money.price),
            "–" if money.carbon is None else digits(_kwh(money, count) * money.carbon),
        )
        for period, count in rows
    )


def costs_note(money: Money) -> str:
    """Omitted costs, with the reasons."""
    missing = [
        words
        for words, value in (
            ("price", money.price),
            ("carbon intensity", money.carbon),
            ("shifts per year", money.shifts),
        )
        if value is None
    ]
    given = f"Not given: {', '.join(missing)}. " if missing else ""
    box = (
        "The control box and mains losses are not included, because no measured power is given."
        if money.box is None
        else f"The control box is included with {digits(money.box)} W."
    )
    return given + box


def _kwh(money: Money, cycles: float) -> float:
    return money.energy * cycles / JOULES_PER_KWH


def _value(costs: dict[str, Any], name: str) -> float | None:
    given = costs.get(name)
    return None if given is None else float(given["value"])
