"""Comparison of a motion with a course: order-preserving match of their points.

A point of the motion is matched with the course point of least deviation. The deviation includes
the part of the course omitted since the previous match, so a match depends on its predecessor. All
points are matched at once from a guess of their predecessors, and then, in rounds, those whose
predecessor has changed. By induction, the result equals the sequential matching: the first match
depends on no other match, and every other match is renewed until its predecessor is final.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Mask

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True)
class MatchingSettings:
    """Settings of the search for matches."""

    look_ahead: float = 2.0
    """Distance of the search ahead on the course, relative to the distance that the motion and its
    tolerances reach.
    """
    least_square: float = 1e-24
    """Squared distance of two course points below which they are one [m²]."""
    rounds: int = 8
    """Largest number of rounds in which many points are matched at once; the points that still
    change are then matched one after another.
    """
    most_pieces: int = 100_000
    """Largest number of course pieces that are compared with points at once."""


SETTINGS = MatchingSettings()


@dataclass(frozen=True, eq=False)
class _Places:
    """Places on a course."""

    piece: Indices
    """Index of the piece, shape (k,)."""
    share: Array
    """Share of the piece, shape (k,)."""
    length: Array
    """Length of the course up to the place, shape (k,) [m]."""
    point: Array
    """Point of the course, shape (k, d)."""
    left_out: Array
    """Omitted part of the course since the previous place, shape (k,) [m]."""

    def at(self, k: Indices) -> _Places:
        """The places of indices k."""
        return _Places(
            self.piece[k], self.share[k], self.length[k], self.point[k], self.left_out[k]
        )

    def replace(self, k: Indices, others: _Places) -> Mask:
        """Replace the places of indices k by others, in place; return the mask of those that
        change.
        """
        changed: Mask = (self.piece[k] != others.piece) | (self.share[k] != others.share)
        self.piece[k], self.share[k], self.length[k] = others.piece, others.share, others.length
        self.point[k], self.left_out[k] = others.point, others.left_out
        return changed


class _Course:
    """Course through points (m, d) with distances in metres; `reach` is the length of the
    tolerances [m].
    """

    def __init__(self, known: Array, reach: float) -> None:
        self.known, self.reach = known, reach
        self.chords = np.diff(known, axis=0)
        self.squares = (self.chords**2).sum(axis=1)
        self.lengths = np.concatenate([[0.0], np.cumsum(np.sqrt(self.squares))])

    def guess(self, moved: Array) -> _Places:
        """Guess the places in proportion to the length of a motion.

        Args:
            moved: lengths of the motion between successive points, shape (k,) [m].

        Returns:
            The start of the course, then the places of the points, shape (k + 1,).
        """
        distance = np.append(0.0, np.cumsum(moved))
        length = distance * (self.lengths[-1] / max(distance[-1], SETTINGS.least_square))
        piece = np.clip(
            np.searchsorted(self.lengths, length, side="right") - 1, 0, len(self.chords) - 1
        )
        piece[0] = 0
        share = np.clip(
            (length - self.lengths[piece])
            / np.sqrt(np.maximum(self.squares[piece], SETTINGS.least_square)),
            0.0,
            1.0,
        )
        point = self.known[piece] + share[:, None] * self.chords[piece]
        return _Places(piece, share, length, point, np.zeros_like(distance))

    def match(self, places: _Places, k: Indices, asked: Array, moved: Array) -> Mask:
        """Match the points of indices k, from their previous places.

        Args:
            places: as of `guess`; changed in place.
            k: indices of points, ascending.
            asked: all points of the motion, shape (n, d).
            moved: lengths of the motion between them, shape (n,) [m].

        Returns:
            Mask of the points (k,) whose places change.
        """
        before = places.at(k)
        last = np.searchsorted(
            self.lengths, before.length + SETTINGS.look_ahead * moved[k] + self.reach
        )
        last = np.clip(last, before.piece + 1, len(self.chords))
        width = last - before.piece
        changed = np.zeros(len(k), dtype=bool)
        for group in _of_similar(width):
            found = self._after(before.at(group), last[group], asked[k[group]])
            changed[group] = places.replace(k[group] + 1, found)
        return changed

    def _after(self, before: _Places, last: Indices, asked: Array) -> _Places:
        """Matches (k,) of points `asked` (k, d), from their previous places.

        Among the places in the pieces up to `last` (k,), the one of least deviation plus omitted
        length is taken. No match is before the previous one: where the course turns back, a motion
        would otherwise be matched backwards with the part that it has already followed.
        """
        first = before.piece
        pieces = first[:, None] + np.arange(int((last - first).max()))
        too_far = pieces >= last[:, None]
        pieces = np.minimum(pieces, len(self.chords) - 1)
        start, chord, square = self.known[pieces], self.chords[pieces], self.squares[pieces]
        # Where the course turns back, two of its points may coincide.
        share = np.clip(
            ((asked[:, None] - start) * chord).sum(axis=2)
            / np.maximum(square, SETTINGS.least_square),
            np.where(pieces == first[:, None], before.share[:, None], 0.0),
            1.0,
        )
        points = start + share[..., None] * chord
        lengths = self.lengths[pieces] + share * np.sqrt(square)
        apart = ((points - before.point[:, None]) ** 2).sum(axis=2)
        skipped = np.sqrt(np.maximum((lengths - before.length[:, None]) ** 2 - apart, 0.0)) / 2
        off = np.linalg.norm(asked[:, None] - points, axis=2) + skipped
        best = np.where(too_far, np.inf, off).argmin(axis=1)
        rows = np.arange(len(asked))
        return _Places(
            pieces[rows, best],
            share[rows, best],
            lengths[rows, best],
            points[rows, best],
            skipped[rows, best],
        )


def matched(at: Array, known: Array, asked: Array, reach: float) -> tuple[Array, Array, float]:
    """Matches the points of a motion with those of a course.

    Args:
        at: fractions of the known course points, shape (m,).
        known: course points, shape (m, d).
        asked: points of the motion, shape (k, d).
        reach: length by which the tolerances extend the search [m].

    Returns:
        The fractions (k,) of the matches, the omitted length (k,) [m] before each, and the length
        [m] after the last one.
    """
    course = _Course(known, SETTINGS.look_ahead * reach)
    moved = np.linalg.norm(np.diff(asked, axis=0, prepend=asked[:1]), axis=1)
    places, count = course.guess(moved), len(asked)
    is_open = np.ones(count + 1, dtype=bool)
    for _ in range(SETTINGS.rounds):
        k = np.flatnonzero(is_open[:count])
        if not len(k):
            break
        is_open[:] = False
        is_open[k[course.match(places, k, asked, moved)] + 1] = True
    for each in range(count):
        if is_open[each]:
            is_open[each + 1] |= course.match(places, np.array([each]), asked, moved)[0]
    found = places.at(np.arange(1, count + 1))
    best = at[found.piece] + found.share * (at[found.piece + 1] - at[found.piece])
    return best, found.left_out, float(course.lengths[-1] - found.length[-1])


def _of_similar(width: Indices) -> list[Indices]:
    """Groups of indices whose widths (k,) differ by at most a factor of two, of limited size."""
    order = np.argsort(width, kind="stable")
    _, exponent = np.frexp(width[order])
    groups = np.split(order, np.flatnonzero(np.diff(exponent)) + 1)
    return [
        part
        for group in groups
        for part in np.array_split(
            group, 1 + len(group) * int(width[group].max()) // SETTINGS.most_pieces
        )
    ]
