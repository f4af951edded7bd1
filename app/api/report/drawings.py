"""Drawings of a report as SVG: power over time with the legs of a cycle, and energies of moves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self
from xml.sax.saxutils import escape

from joulepath.app.api.report.numbers import digits
from joulepath.optimizer.dynamics.losses import ENERGY_FLOOR


@dataclass(frozen=True)
class DrawingSettings:
    """Sizes [px] and colours of the drawings."""

    width: float = 1000.0
    """Width of a drawing."""
    left: float = 52.0
    """Left margin, with labels."""
    right: float = 6.0
    """Right margin."""
    legs: float = 118.0
    """Height of the legs."""
    power: float = 92.0
    """Height of the power curve."""
    foot: float = 24.0
    """Lower margin, with times."""
    stop: float = 11.0
    """Radius of the numbers of stops; a number that would cover another one is left out."""
    ink: str = "#17202b"
    """Colour of text."""
    grey: str = "#616d79"
    """Colour of labels."""
    line: str = "#e2e7ec"
    """Colour of grid lines."""
    loaded: str = "#14805f"
    """Colour of moves with a payload."""
    empty: str = "#e6f2ee"
    """Colour of moves without a payload."""
    bar: str = "#8fc4b2"
    """Colour of the energy of a move."""
    rest: str = "#c3cbd3"
    """Colour of rests."""


DRAWING = DrawingSettings()
_MOST_POINTS = 600
_MOST_BARS = 1000
_MOST_LABELS = 25
_TICKS = (
    0.05,
    0.1,
    0.2,
    0.5,
    1,
    2,
    5,
    10,
    20,
    50,
    100,
    200,
    500,
    1000,
    2000,
    5000,
    1e4,
    2e4,
    5e4,
    1e5,
)


@dataclass(frozen=True)
class Leg:
    """A move or a rest: from `t0` [s], for `duration` [s], with `energy` [J]."""

    t0: float
    duration: float
    energy: float
    rests: bool
    loaded: bool


@dataclass(frozen=True)
class Stop:
    """A stop by its number, at `t` [s]; `takes`: a part is taken up."""

    t: float
    number: int
    takes: bool


@dataclass(frozen=True)
class Course:
    """A motion or a cycle over time: `power` [W] at times `t` [s]."""

    duration: float
    t: Sequence[float]
    power: Sequence[float]
    legs: Sequence[Leg] = ()
    stops: Sequence[Stop] = ()


@dataclass(frozen=True)
class Bar:
    """The energy of a move [J], the ends of its interval, and its measured energy."""

    name: str
    energy: float
    ends: tuple[float, float] | None = None
    dot: float | None = None

    @classmethod
    def of(cls, name: str, electrical: Mapping[str, Any], dot: float | None = None) -> Self:
        """The bar of the electrical energy of an answer."""
        known = electrical.get("interval")
        ends = None if known is None else (known["p5"], known["p95"])
        return cls(name, electrical["total"], ends, dot)


def drawn_bars(bars: Sequence[Bar]) -> str:
    """The energies of moves, side by side; empty without a move, or with too many of them."""
    if not 0 < len(bars) <= _MOST_BARS:
        return ""
    low, high = DRAWING.legs + 30.0, 10.0
    known = [value for bar in bars for value in (bar.energy, bar.dot, *(bar.ends or ()))]
    most: float = max(ENERGY_FLOOR, *(value for value in known if value is not None))
    step = (DRAWING.width - DRAWING.left - DRAWING.right) / len(bars)

    def y(energy: float) -> float:
        return low - (low - high) * max(energy, 0.0) / most

    tick = _tick(most / 5)
    levels = [k * tick for k in range(int(most / tick) + 1)]
    parts = [*_grid([(level, y(level)) for level in levels], "J")]
    every = max(math.ceil(len(bars) / _MOST_LABELS), 1)
    for k, bar in enumerate(bars):
        middle, half = DRAWING.left + (k + 0.5) * step, 0.5 * step
        parts.append(
            f'<rect x="{middle - 0.72 * half:.1f}" y="{y(bar.energy):.1f}" '
            f'width="{1.44 * half:.1f}" height="{low - y(bar.energy):.1f}" '
            f'fill="{DRAWING.bar}"/>'
        )
        if bar.ends is not None:
            down, up = map(y, bar.ends)
            parts.append(
                f'<path d="M{middle:.1f} {down:.1f}V{up:.1f}" stroke="{DRAWING.grey}" '
                f'stroke-width="{min(1.6, half):.1f}"/>'
            )
        if bar.dot is not None:
            size = min(4.5, max(half, 1.5))
            parts.append(
                f'<circle cx="{middle:.1f}" cy="{y(bar.dot):.1f}" r="{size:.1f}" '
                f'fill="{DRAWING.ink}" stroke="#fff"/>'
            )
        if k % every == 0:
            parts.append(words_at(middle, low + 17, bar.name, DRAWING.grey, "middle"))
    return document(low + DRAWING.foot, parts)


def drawn(course: Course) -> str:
    """The course, with a row of legs above the power if there is more than one."""
    top = DRAWING.legs if len(course.legs) > 1 else 8.0
    height = top + DRAWING.power + DRAWING.foot
    parts = [*(_legs(course) if len(course.legs) > 1 else ()), *_power(course, top)]
    return document(height, parts)


def document(height: float, parts: Sequence[str], width: float = DRAWING.width) -> str:
    """A drawing of this size [px]."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'font-family="Inter, DejaVu Sans, sans-serif" font-size="12.5">{"".join(parts)}</svg>'
    )


def _x(course: Course, t: float) -> float:
    return DRAWING.left + (DRAWING.width - DRAWING.left - DRAWING.right) * t / course.duration


def _legs(course: Course) -> Iterator[str]:
    """Legs with their joules: width by time, height by mean power."""
    mean = [leg.energy / leg.duration for leg in course.legs]
    most, low, high = max(1.0, *mean), DRAWING.legs - 18.0, 34.0
    yield from _grid([(0.0, low), (_round_below(most), low - (low - high) * _of(most))])
    for leg, power in zip(course.legs, mean, strict=True):
        left, right = _x(course, leg.t0), _x(course, leg.t0 + leg.duration)
        tall = max((low - high) * power / most, 2.0)
        fill = DRAWING.rest if leg.rests else (DRAWING.loaded if leg.loaded else DRAWING.empty)
        edge = "" if leg.rests or leg.loaded else f' stroke="{DRAWING.loaded}" stroke-width="1.2"'
        wide = max(right - left - 1.6, 1.0)
        yield (
            f'<rect x="{left + 0.8:.1f}" y="{low - tall:.1f}" width="{wide:.1f}" '
            f'height="{tall:.1f}" rx="3" fill="{fill}"{edge}/>'
        )
        text = digits(leg.energy)
        if not leg.rests and right - left > 9 * len(text) + 8:
            ink = "#ffffff" if leg.loaded else DRAWING.ink
            y = low - tall / 2 + 4.5
            yield words_at((left + right) / 2, y, text, ink, "middle", 600)
    free = 0.0
    for stop in course.stops:
        x = _x(course, stop.t)
        fill, ink, edge = (
            (DRAWING.loaded, "#fff", DRAWING.loaded)
            if stop.takes
            else ("#fff", DRAWING.ink, DRAWING.ink)
        )
        yield f'<path d="M{x:.1f} 24V{low:.1f}" stroke="{DRAWING.rest}"/>'
        if x < free:
            continue
        free = x + 2 * DRAWING.stop
        yield f'<circle cx="{x:.1f}" cy="14" r="{DRAWING.stop:g}" fill="{fill}" stroke="{edge}"/>'
        yield words_at(x, 18.4, str(stop.number), ink, "middle", 600)


def _power(course: Course, top: float) -> Iterator[str]:
    most = max(max(course.power), 1.0)
    low, step = top + DRAWING.power, _tick(most / 2)

    def y(power: float) -> float:
        return low - (DRAWING.power - 12) * power / most

    levels = [k * step for k in range(int(most / step) + 1)]
    yield from _grid([(level, y(level)) for level in levels])
    each = max(len(course.t) // _MOST_POINTS, 1)
    points = [
        f"{_x(course, t):.1f} {y(power):.1f}"
        for t, power in list(zip(course.t, course.power, strict=True))[::each]
    ]
    line = "M" + "L".join(points)
    ends = _x(course, course.t[0]), _x(course, course.t[-1])
    area = f"{line}L{ends[1]:.1f} {y(0.0):.1f}L{ends[0]:.1f} {y(0.0):.1f}Z"
    yield f'<path d="{area}" fill="{DRAWING.loaded}" opacity="0.14"/>'
    yield f'<path d="{line}" fill="none" stroke="{DRAWING.loaded}" stroke-width="1.8"/>'
    step = _tick(course.duration / 8)
    for k in range(int(course.duration / step) + 1):
        last = (k + 1) * step > course.duration
        text = f"{k * step:g}" + (" s" if last else "")
        x = _x(course, k * step)
        anchor = "end" if x > DRAWING.width - 3 * DRAWING.right else "middle"
        yield words_at(x, low + 17, text, DRAWING.grey, anchor)


def _grid(levels: Sequence[tuple[float, float]], name: str = "W") -> Iterator[str]:
    """Horizontal lines with their values, in the unit `name`."""
    end = DRAWING.width - DRAWING.right
    for level, y in levels:
        yield f'<path d="M{DRAWING.left} {y:.1f}H{end}" stroke="{DRAWING.line}"/>'
        unit = f" {name}" if level and level == levels[-1][0] else ""
        yield words_at(DRAWING.left - 7, y + 4.3, f"{level:,g}{unit}", DRAWING.grey, "end")


def _tick(least: float) -> float:
    """The next larger distance of ticks."""
    return next((tick for tick in _TICKS if tick >= least), _TICKS[-1])


def _round_below(value: float) -> float:
    """The next smaller tick, or the value itself."""
    return max((tick for tick in _TICKS if tick <= value), default=value)


def _of(value: float) -> float:
    return _round_below(value) / value


def words_at(x: float, y: float, words: str, ink: str, anchor: str, weight: int = 400) -> str:
    """Words at a point [px]."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" fill="{ink}" text-anchor="{anchor}" '
        f'font-weight="{weight}">{escape(words)}</text>'
    )
