"""Distances of many pairs by the C library: bounds, closed forms, separations and gradients.

Index arrays (k,) select cases: `configuration` is a row of `frames` (n, nq + 1, 4, 4), the
T_base_link [m] of every link, and `pair` an index of a pair.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.pair_arrays import PairArrays, PairKind
from joulepath.optimizer.native.shared_library import address, library

# In the order of the C structure.
_SIZES = ("frames", "bodies", "most_points")
_ARRAYS = (
    "first",
    "second",
    "kinds",
    "growth",
    "links",
    "counts",
    "points",
    "ball_centres",
    "ball_radii",
    "axes",
    "disc_radii",
    "half_sizes",
    "T_link_core",
    "primitive",
    "covered",
    "cover_centres",
    "cover_radii",
    "primitive_half_sizes",
    "is_cylinder",
)


class _Shapes(ctypes.Structure):
    """The C structure `Shapes`: sizes, and the addresses of the arrays of `PairArrays`."""

    _fields_ = [(name, ctypes.c_long) for name in _SIZES] + [
        (name, ctypes.c_void_p) for name in _ARRAYS
    ]


class CompiledDistances:
    """Distances of the pairs of some bodies on the links of an arm of nq joints."""

    def __init__(self, arrays: PairArrays, nq: int) -> None:
        self._arrays, self._nq, self._bodies = arrays, nq, len(arrays.links)
        sources = vars(arrays) | {"first": arrays.pairs[:, 0], "second": arrays.pairs[:, 1]}
        # An address does not keep its array alive.
        self._kept = [_plain(sources[name]) for name in _ARRAYS]
        self._shapes = _Shapes(
            nq + 1, self._bodies, arrays.points.shape[1], *map(address, self._kept)
        )
        self._of = ctypes.addressof(self._shapes)

    def bounds(
        self, frames: Array, pairs: Indices, within: float, known: Array | None
    ) -> tuple[Array, Indices, Indices]:
        """Lower bounds (n, p) [m] on the distances of `pairs` (p,), and rows and columns (k,) of
        the bounds of at most `within`.

        The bounds are those of enclosing balls, improved by covering spheres if `within` is finite,
        or the `known` bounds (n, p) that exceed `within`. No ball encloses a half-space: its pairs
        get -inf.
        """
        n, p = len(frames), len(pairs)
        distance = np.empty((n, p)) if known is None else known.copy()
        row, column = np.empty(n * p, dtype=np.intp), np.empty(n * p, dtype=np.intp)
        workspace = np.empty((self._bodies, 3))
        arguments = _plain(frames), _plain(pairs)
        count = library.bounds(
            self._of,
            n,
            address(arguments[0]),
            p,
            address(arguments[1]),
            within,
            known is not None,
            *map(address, (distance, row, column, workspace)),
        )
        return distance, row[:count], column[:count]

    def cover_bounds(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds (k,) [m] on the signed distances of pairs (k,) at configurations (k,), by
        spheres that cover one body, against the box or cylinder of the other.

        The ball around a board is as large as the board is long, and contains much of a cell. The
        distance of a few covering spheres bounds the distance of the bodies almost as well as the
        exact one, in a fraction of the time. The bound is -inf for pairs without a box or a
        cylinder, and if the cores may overlap.
        """
        result = np.empty(len(pair))
        self._call(library.bead_bounds, frames, configuration, pair, result)
        return result

    def witness_points(
        self, frames: Array, configuration: Indices, pair: Indices, within: float = np.inf
    ) -> tuple[Array, Array, Array]:
        """Signed distance of the cores (k,) [m], normal and point (k, 3), as of
        `PairGeometry.witness_points`.

        The distance is NaN if Coal or a cloud has to compute it: that of overlapping cores without
        a closed form, and that of clouds. It is infinite if it has no closed form and the bodies
        are farther apart than `within` [m].
        """
        k = len(pair)
        distance, normal, point = np.empty(k), np.empty((k, 3)), np.empty((k, 3))
        of_pairs = [_plain(each) for each in (frames, configuration, pair)]
        library.witness_points(
            self._of,
            address(of_pairs[0]),
            k,
            *map(address, of_pairs[1:]),
            within,
            *map(address, (distance, normal, point)),
        )
        return distance, normal, point

    def separations(
        self,
        frames: Array,
        begin: Indices,
        end: Indices,
        pair: Indices,
        normals: tuple[Array, Array],
    ) -> Array:
        """Separations (k,) [m] of pairs (k,) that hold at the configurations `begin` and `end`
        (k,).

        The separation along a unit vector n is min n·x over the second body - max n·x over the
        first; it never exceeds the signed distance. For a half-space, n must be its outward normal.
        Unit `normals` (k, 3) at both configurations move with the first body. Every normal is rated
        by the smaller of its two separations, and the better one counts.
        """
        result = np.empty(len(pair))
        self._call(library.separations, frames, begin, end, pair, *normals, result)
        return result

    def supports(
        self, frames: Array, configuration: Indices, body: Indices, normal: Array
    ) -> Array:
        """Least n·x (k,) [m] over the cores of bodies (k,), for unit vectors n (k, 3) in the base
        frame.
        """
        result = np.empty(len(body))
        self._call(library.supports, frames, configuration, body, normal, result)
        return result

    def gradients(
        self, frames: Array, configuration: Indices, pair: Indices, normal: Array, point: Array
    ) -> Array:
        """Gradients (k, nq) [m/rad] of signed distances, see `CollisionModel.gradients`."""
        result = np.empty((len(pair), self._nq))
        self._call(library.gradients, frames, configuration, pair, normal, point, result)
        return result

    def clearance_check(
        self, placements: Array, pairs: Indices, levers: Array, reserve: float
    ) -> ClearanceCheck:
        """A check whether all of `pairs` (p,) are at least `reserve` [m] apart.

        Args:
            placements: those of `link_frames`, shape (n, 4, 4).
            pairs: pairs of bodies that are no clouds.
            levers: greatest changes of their distances per radian, shape (p, n) [m/rad].
            reserve: least distance beyond the margins [m].
        """
        return ClearanceCheck(
            self._shapes, self._kept, self._arrays, placements, pairs, levers, reserve
        )

    def _call(self, function: Any, frames: Array, *arrays: Array | Indices) -> None:
        """Calls a function of as many cases as the arrays are long; the last arrays are its
        results.
        """
        arguments = [_plain(array) for array in (frames, *arrays)]
        function(self._of, address(arguments[0]), len(arguments[1]), *map(address, arguments[1:]))


class _Check(ctypes.Structure):
    """The C structure `Check`."""

    _fields_ = [
        ("shapes", ctypes.c_void_p),
        ("placements", ctypes.c_void_p),
        ("p", ctypes.c_long),
        ("rows", ctypes.c_long),
        *((name, ctypes.c_void_p) for name in ("pairs", "ends", "reach", "levers", "lever_of")),
        ("reserve", ctypes.c_double),
        *(
            (name, ctypes.c_void_p)
            for name in ("frames", "directions", "centre", "changes", "open", "last")
        ),
    ]


class ClearanceCheck:
    """Checks one configuration after the other. Not for several threads at once.

    A check ends at the first pair that is too near, and begins with the one at which the last check
    ended. The search for a direction that separates two convex bodies begins along the last one.

    Attributes:
        frames: T_base_link (n + 1, 4, 4) [m] of all links at the last configuration.
    """

    def __init__(
        self,
        shapes: _Shapes,
        kept: list[Array | Indices],
        arrays: PairArrays,
        placements: Array,
        pairs: Indices,
        levers: Array,
        reserve: float,
    ) -> None:
        p, n = levers.shape
        self.frames, self._ends = np.empty((n + 1, 4, 4)), np.empty((2, n))
        ends = arrays.pairs[pairs]
        reach = arrays.ball_radii[ends].sum(axis=1) + arrays.growth[pairs] + reserve
        # no ball encloses a half-space
        reach[arrays.kinds[pairs] == PairKind.HALF_SPACE] = np.inf
        # the levers to fixed obstacles are those of the body alone
        rows, lever_of = np.unique(levers, axis=0, return_inverse=True)
        given = [_plain(each) for each in (placements, pairs, ends, reach, rows, lever_of.ravel())]
        workspace = [
            self.frames,
            np.zeros((p, 3)),
            np.empty((shapes.bodies, 3)),
            np.empty(len(rows)),
            np.empty(p, dtype=np.intp),
            np.zeros(1, dtype=np.intp),
        ]
        # an address does not keep its array alive
        self._kept = shapes, kept, given, workspace
        self._check = _Check(
            ctypes.addressof(shapes),
            address(given[0]),
            p,
            len(rows),
            *map(address, given[1:]),
            reserve,
            *map(address, workspace),
        )
        self._checked = np.zeros(1, dtype=np.intp)
        self._arguments = ctypes.addressof(self._check), *map(address, self._ends)
        self._checked_address = address(self._checked)

    def is_met(self, q: Array) -> bool:
        """Whether the pairs are far enough apart at q (n,) [rad] of the chain."""
        return self.is_met_between(q, q, 1)[0]

    def is_met_between(self, q: Array, q_end: Array, count: int) -> tuple[bool, int]:
        """Whether the pairs are far enough apart at `count` evenly spaced configurations from q
        to q_end (n,) [rad], without the first, and how many of these were checked.
        """
        self._ends[0], self._ends[1] = q, q_end
        is_met = bool(library.is_clear_between(*self._arguments, count, self._checked_address))
        return is_met, int(self._checked[0])


def _plain(array: Array | Indices) -> Array | Indices:
    """The array in C's form: contiguous, with 64 bits per number."""
    kind = float if array.dtype == float else np.intp
    return np.ascontiguousarray(array, dtype=kind)
