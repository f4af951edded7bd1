"""Comparison of a motion with a course: order-preserving match of their points.

A point of the motion is matched with the course point of least deviation. The deviation includes
the part of the course omitted since the previous match, so a match depends on its predecessor. All
points are matched at once from a guess of their predecessors, and again from the result until it no
longer changes. By induction, a fixed point equals the sequential matching: the first match depends
on no other match, and every other match depends on an unchanged one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array


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
    """Largest number of rounds in which all points are matched at once."""
    most_numbers: int = 2_000_000
    """Largest number of array elements of such a round."""


SETTINGS = MatchingSettings()


@dataclass(frozen=True)
class _Places:
    """Places on a course."""

    piece: npt.NDArray[np.intp]
    """Index of the piece, shape (k,)."""
    share: Array
    """Share of the piece, shape (k,)."""
    length: Array
    """Length of the course up to the place, shape (k,) [m]."""
    point: Array
    """Point of the course, shape (k, d)."""
    left_out: Array
    """Omitted part of the course since the previous place, shape (k,) [m]."""

    def before(self, first: Array) -> _Places:
        """Previous places: the first point (d,) of the course, then all places but the last."""
        return _Places(
            np.append(0, self.piece[:-1]),
            np.append(0.0, self.share[:-1]),
            np.append(0.0, self.length[:-1]),
            np.concatenate([first[None], self.point[:-1]]),
            np.append(0.0, self.left_out[:-1]),
        )


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
            Places on the course, shape (k,).
        """
        distance = np.cumsum(moved)
        length = distance * (self.lengths[-1] / max(distance[-1], SETTINGS.least_square))
        piece = np.clip(
            np.searchsorted(self.lengths, length, side="right") - 1, 0, len(self.chords) - 1
        )
        share = np.clip(
            (length - self.lengths[piece])
            / np.sqrt(np.maximum(self.squares[piece], SETTINGS.least_square)),
            0.0,
            1.0,
        )
        point = self.known[piece] + share[:, None] * self.chords[piece]
        return _Places(piece, share, length, point, np.zeros_like(distance))

    def after(self, before: _Places, asked: Array, moved: Array) -> _Places | None:
        """Matches (k,) of points `asked` (k, d), from their previous places; None if the arrays
        would be too large.

        Among the places within reach, the one of least deviation plus omitted length is taken. No
        match is before the previous one: where the course turns back, a motion would otherwise be
        matched backwards with the part that it has already followed.
        """
        first = before.piece
        last = np.searchsorted(
            self.lengths, before.length + SETTINGS.look_ahead * moved + self.reach
        )
        last = np.minimum(last, len(self.chords))
        width = int((last - first).max())
        if width * asked.size > SETTINGS.most_numbers and len(asked) > 1:
            return None
        pieces = first[:, None] + np.arange(width)
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
    found, same = course.guess(moved), 0
    for _ in range(SETTINGS.rounds):
        again = course.after(found.before(known[0]), asked, moved)
        if again is None:
            break
        changed = (again.piece != found.piece) | (again.share != found.share)
        found, same = again, int(changed.argmax()) + 1 if changed.any() else len(asked)
        if same == len(asked):
            break
    for k in range(same, len(asked)):
        _match_next(course, found, k, asked, moved)
    best = at[found.piece] + found.share * (at[found.piece + 1] - at[found.piece])
    return best, found.left_out, float(course.lengths[-1] - found.length[-1])


def _match_next(course: _Course, found: _Places, k: int, asked: Array, moved: Array) -> None:
    """Sets the match of point `k` in `found`, from the one before it; in place."""
    own = slice(max(k - 1, 0), max(k - 1, 0) + 1)
    last = _Places(
        found.piece[own], found.share[own], found.length[own], found.point[own], found.left_out[own]
    )
    if k == 0:
        last = _Places(
            np.zeros(1, dtype=np.intp), np.zeros(1), np.zeros(1), course.known[:1], np.zeros(1)
        )
    place = course.after(last, asked[k : k + 1], moved[k : k + 1])
    assert place is not None
    found.piece[k] = place.piece[0]
    found.share[k] = place.share[0]
    found.length[k] = place.length[0]
    found.point[k], found.left_out[k] = place.point[0], place.left_out[0]
