"""The map of a placement as SVG: the energy at every place as a colour, seen from above."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

from joulepath.app.api.report.drawings import DRAWING, document, words_at
from joulepath.app.api.report.numbers import digits

Json = Mapping[str, Any]


@dataclass(frozen=True)
class MapSettings:
    """Sizes [px] and colours of the map."""

    width: float = 460.0
    """Width of the drawing."""
    most: float = 260.0
    """Greatest height of the map alone."""
    left: float = 24.0
    """Margin on the left and the right."""
    top: float = 16.0
    """Upper margin."""
    scale: float = 130.0
    """Length of the scale of colours."""
    row: float = 20.0
    """Height of a row of the legend."""
    alone: float = 0.1
    """Distance of places where there is one alone along an axis [m]."""
    best: str = "#b3261e"
    """Colour of the mark of the best place."""
    ramp: tuple[str, ...] = (
        "#00306f",
        "#39486b",
        "#62616d",
        "#8a7b75",
        "#b6996a",
        "#e1bd52",
        "#ffe945",
    )
    """Colours from the least to the greatest energy: cividis, which the colour-blind tell apart."""


MAP = MapSettings()
REASONS = {
    "reach": ("M-1 -1L1 1M1 -1L-1 1", "out of reach"),
    "collision": ("M-1 -1H1V1H-1Z", "in collision"),
    "torque": ("M-1 -0.8H1L0 1Z", "insufficient torque"),
    "time": ("M-1 0.8H1L0 -1Z", "takes too long"),
    "motion": ("M-1 0H1M0 -1V1", "no motion found"),
    None: ("M-0.2 0H0.2", "not computed"),
}
"""Mark and words of places without an energy, by the reason."""


def at_floor(place: Json) -> tuple[float, float]:
    """Position on the floor [m] of the first moved group, or else of the base."""
    moved = place["offsets"][0] if place["offsets"] else place["base"]
    x, y, _ = moved["position"]
    return x, y


def columns_of(places: Sequence[Json]) -> list[Json]:
    """The best place of every vertical column; without an energy, a place left out."""
    best = dict[tuple[float, float], Json]()

    def rank(place: Json) -> tuple[int, float]:
        if place["energy"] is not None:
            return 0, place["energy"]
        return (1 if place["reason"] is None else 2), 0.0

    for place in places:
        x, y = at_floor(place)
        at = round(x, 6), round(y, 6)
        if at not in best or rank(place) < rank(best[at]):
            best[at] = place
    return list(best.values())


def drawn_map(places: Sequence[Json], best: Json, nominal: Json | None) -> str:
    """The map, seen from above: x to the right, y upwards.

    Args:
        places: places of the map.
        best: best place.
        nominal: nominal place; None if its cycles are infeasible.
    """
    columns = columns_of(places)
    points = [at_floor(each) for each in columns]
    pitch = [_pitch([point[axis] for point in points]) for axis in (0, 1)]
    named = {"nominal": nominal, "best": best} if nominal is not None else {"best": best}
    ends = [*points, *map(at_floor, named.values())]
    low = [min(point[axis] for point in ends) - pitch[axis] / 2 for axis in (0, 1)]
    high = [max(point[axis] for point in ends) + pitch[axis] / 2 for axis in (0, 1)]
    wide, tall = high[0] - low[0], high[1] - low[1]
    scale = min((MAP.width - 2 * MAP.left) / wide, MAP.most / tall)
    middle = (MAP.width - scale * wide) / 2

    def at(place: Json) -> tuple[float, float]:
        x, y = at_floor(place)
        return middle + scale * (x - low[0]), MAP.top + scale * (high[1] - y)

    energies = [each["energy"] for each in columns if each["energy"] is not None]
    parts = [*_tiles(columns, at, (scale * pitch[0], scale * pitch[1]), energies)]
    parts += [_end(*at(place), name) for name, place in named.items()]
    foot = MAP.top + scale * tall
    apart = wide - pitch[0]
    if apart > 0:
        parts += _ruler(middle + scale * pitch[0] / 2, foot, scale * apart, apart)
    legend = _Legend(foot + 36)
    parts += legend.drawn(columns, energies, named)
    return document(legend.y + MAP.row + 10, parts, MAP.width)


def _pitch(values: Sequence[float]) -> float:
    different = sorted({round(value, 6) for value in values})
    steps = [b - a for a, b in pairwise(different)]
    return min(steps, default=MAP.alone)


def _tiles(
    columns: Sequence[Json], at: Any, size: tuple[float, float], energies: Sequence[float]
) -> Iterator[str]:
    wide, tall = 0.95 * size[0], 0.95 * size[1]
    for place in columns:
        x, y = at(place)
        if place["energy"] is None:
            mark, _ = REASONS[place["reason"]]
            yield _mark(mark, x, y, 0.22 * min(wide, tall))
            continue
        yield (
            f'<rect x="{x - wide / 2:.1f}" y="{y - tall / 2:.1f}" width="{wide:.1f}" '
            f'height="{tall:.1f}" fill="{_colour(place["energy"], energies)}"/>'
        )


def _colour(energy: float, energies: Sequence[float]) -> str:
    """The colour of an energy on the ramp from the least to the greatest energy."""
    least, most = min(energies), max(energies)
    share = (len(MAP.ramp) - 1) * ((energy - least) / (most - least) if most > least else 0.0)
    k = min(int(share), len(MAP.ramp) - 2)
    one, other = ([int(MAP.ramp[each][c : c + 2], 16) for c in (1, 3, 5)] for each in (k, k + 1))
    mixed = (round(a + (share - k) * (b - a)) for a, b in zip(one, other, strict=True))
    return "#" + "".join(f"{part:02x}" for part in mixed)


def _mark(path: str, x: float, y: float, size: float = 5.0) -> str:
    return (
        f'<path d="{path}" transform="translate({x:.1f} {y:.1f}) scale({size:.2f})" fill="none" '
        f'stroke="{DRAWING.grey}" stroke-width="{1.6 / size:.3f}" stroke-linecap="round"/>'
    )


def _end(x: float, y: float, name: str) -> str:
    """The mark of the best place, filled, or of the nominal one."""
    fill = MAP.best if name == "best" else "#fff"
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="7" fill="#fff"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{fill}" stroke="{MAP.best}" '
        'stroke-width="2"/>'
    )


def _ruler(left: float, y: float, wide: float, metres: float) -> Iterator[str]:
    """The distance of the outermost places along x, below the map."""
    yield (
        f'<path d="M{left:.1f} {y + 6:.1f}v6m0 -3H{left + wide:.1f}m0 -3v6" fill="none" '
        f'stroke="{DRAWING.grey}"/>'
    )
    words = f"x: {digits(1e3 * metres)} mm"
    yield words_at(left + wide / 2, y + 24, words, DRAWING.grey, "middle")


class _Legend:
    """Legend of colours and marks, in rows from the height `y` [px] on."""

    def __init__(self, y: float) -> None:
        self.x, self.y = MAP.left, y

    def drawn(
        self, columns: Sequence[Json], energies: Sequence[float], named: Mapping[str, Json]
    ) -> Iterator[str]:
        """The scale of energies, then the marks present in the map."""
        if energies:
            yield from self._scale(min(energies), max(energies))
        failed = {each["reason"] for each in columns if each["energy"] is None}
        for reason, (mark, words) in REASONS.items():
            if reason in failed:
                yield from self._entry(words, partial(_mark, mark))
        for name in named:
            yield from self._entry(f"{name} place", partial(_end, name=name))

    def _entry(self, words: str, sign: Callable[[float, float], str]) -> Iterator[str]:
        wide = 7.2 * len(words) + 34
        if self.x + wide > MAP.width:
            self.x, self.y = MAP.left, self.y + MAP.row
        yield sign(self.x + 6, self.y + 4)
        yield words_at(self.x + 18, self.y + 8.5, words, DRAWING.grey, "start")
        self.x += wide

    def _scale(self, least: float, most: float) -> Iterator[str]:
        ends, step = (digits(least), f"{digits(most)} J"), MAP.scale / len(MAP.ramp)
        yield words_at(self.x, self.y + 8.5, ends[0], DRAWING.grey, "start")
        self.x += 7.2 * len(ends[0]) + 8
        for k, colour in enumerate(MAP.ramp):
            yield (
                f'<rect x="{self.x + k * step:.1f}" y="{self.y:.1f}" width="{step + 0.5:.1f}" '
                f'height="9" fill="{colour}"/>'
            )
        self.x += MAP.scale + 8
        yield words_at(self.x, self.y + 8.5, ends[1], DRAWING.grey, "start")
        self.x, self.y = MAP.left, self.y + MAP.row
