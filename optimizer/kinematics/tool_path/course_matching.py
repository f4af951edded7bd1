"""Points of a course that those of a motion are compared with, in the order of both.

Each point of a motion has the point of the course that is least off, with what it leaves out since
the point before: so each depends on the one before it. All are looked for at once, from a guess of
those before; then again from what was found, until nothing changes. What is found then is what
going from point to point finds: the first point depends on nothing, and each other one on a point
that did not change.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array

# a point is looked for so many times as far ahead on the course as the motion and its tolerances
# reach
AHEAD = 2.0
# m²: two points of the course that are nearer are the same
TINY = 1e-24
# how often all points are looked for at once, and how many numbers that may take
AT_ONCE, MOST_AT_ONCE = 8, 2_000_000


@dataclass(frozen=True)
class _Places:
    """Places on a course (k,): the number of the piece, the share of it, the length [m] up to
    there, and the point (k, d); and what is `left_out` (k,) [m] since the place before."""

    piece: npt.NDArray[np.intp]
    share: Array
    length: Array
    point: Array
    left_out: Array

    def before(self, first: Array) -> _Places:
        """The places before each of them: the `first` point (d,) of the course, and all but the
        last.
        """
        return _Places(
            np.append(0, self.piece[:-1]),
            np.append(0.0, self.share[:-1]),
            np.append(0.0, self.length[:-1]),
            np.concatenate([first[None], self.point[:-1]]),
            np.append(0.0, self.left_out[:-1]),
        )


class _Course:
    """A course through points (m, d), the distances between which are lengths [m]; `reach` [m] is
    that of the tolerances."""

    def __init__(self, known: Array, reach: float) -> None:
        self.known, self.reach = known, reach
        self.chords = np.diff(known, axis=0)
        self.squares = (self.chords**2).sum(axis=1)
        self.gone = np.concatenate([[0.0], np.cumsum(np.sqrt(self.squares))])

    def guess(self, moved: Array) -> _Places:
        """Places (k,) at the lengths that a motion moves, `moved` (k,) [m] from each of its points
        to the next.
        """
        way = np.cumsum(moved)
        length = way * (self.gone[-1] / max(way[-1], TINY))
        piece = np.clip(
            np.searchsorted(self.gone, length, side="right") - 1, 0, len(self.chords) - 1
        )
        share = np.clip(
            (length - self.gone[piece]) / np.sqrt(np.maximum(self.squares[piece], TINY)), 0.0, 1.0
        )
        point = self.known[piece] + share[:, None] * self.chords[piece]
        return _Places(piece, share, length, point, np.zeros_like(way))

    def after(self, before: _Places, asked: Array, moved: Array) -> _Places | None:
        """The places (k,) of points (k, d), from those before them; None if that takes too many
        numbers.

        Of the places that are not too far ahead, the one is taken that is least off, with what it
        leaves out.
        """
        first = np.maximum(before.piece - 1, 0)
        last = np.searchsorted(self.gone, before.length + AHEAD * moved + self.reach)
        last = np.minimum(last, len(self.chords))
        width = int((last - first).max())
        if width * asked.size > MOST_AT_ONCE and len(asked) > 1:
            return None
        pieces = first[:, None] + np.arange(width)
        too_far = pieces >= last[:, None]
        pieces = np.minimum(pieces, len(self.chords) - 1)
        start, chord, square = self.known[pieces], self.chords[pieces], self.squares[pieces]
        # where the course turns back, two of its points may be the same
        share = np.clip(
            ((asked[:, None] - start) * chord).sum(axis=2) / np.maximum(square, TINY), 0.0, 1.0
        )
        points = start + share[..., None] * chord
        lengths = self.gone[pieces] + share * np.sqrt(square)
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
    """Fractions (k,) of a course that are compared with a motion; what is left out before each (k,)
    [m], and after the last [m].

    `known` (m, d) are the points at fractions `at` (m,), `asked` (k, d) those of the motion;
    `reach` [m] is by how much the tolerances allow to look farther.
    """
    course = _Course(known, AHEAD * reach)
    moved = np.linalg.norm(np.diff(asked, axis=0, prepend=asked[:1]), axis=1)
    found, same = course.guess(moved), 0
    for _ in range(AT_ONCE):
        again = course.after(found.before(known[0]), asked, moved)
        if again is None:
            break
        changed = (again.piece != found.piece) | (again.share != found.share)
        found, same = again, int(changed.argmax()) + 1 if changed.any() else len(asked)
        if same == len(asked):
            break
    for k in range(same, len(asked)):
        _go_on(course, found, k, asked, moved)
    best = at[found.piece] + found.share * (at[found.piece + 1] - at[found.piece])
    return best, found.left_out, float(course.gone[-1] - found.length[-1])


def _go_on(course: _Course, found: _Places, k: int, asked: Array, moved: Array) -> None:
    """Put the place of point `k` into those that are `found`, from the one before it."""
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
    found.piece[k], found.share[k], found.length[k] = (
        place.piece[0],
        place.share[0],
        place.length[0],
    )
    found.point[k], found.left_out[k] = place.point[0], place.left_out[0]
