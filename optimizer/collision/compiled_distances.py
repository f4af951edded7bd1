"""Distances of many pairs by the C library: bounds, closed forms, separations and gradients.

Index arrays (k,) select cases: `configuration` is a row of `frames` (n, nq + 1, 4, 4), the
T_base_link [m] of every link, and `pair` is one of the pairs.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.pair_arrays import PairArrays
from joulepath.optimizer.native.shared_library import address, library

# in the order of the C
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
    "formed",
    "beaded",
    "bead_centres",
    "bead_radii",
    "form_sizes",
    "is_cycle",
)


class _Shapes(ctypes.Structure):
    """The `Shapes` of the C: sizes, and the addresses of the arrays of `PairArrays`."""

    _fields_ = [(name, ctypes.c_long) for name in _SIZES] + [
        (name, ctypes.c_void_p) for name in _ARRAYS
    ]


class CompiledDistances:
    """Distances of the pairs of some bodies on the links of an arm of nq joints."""

    def __init__(self, arrays: PairArrays, nq: int) -> None:
        self._nq, self._bodies = nq, len(arrays.links)
        given = vars(arrays) | {"first": arrays.pairs[:, 0], "second": arrays.pairs[:, 1]}
        # an address does not keep its array alive
        self._kept = [_plain(given[name]) for name in _ARRAYS]
        self._shapes = _Shapes(
            nq + 1, self._bodies, arrays.points.shape[1], *map(address, self._kept)
        )
        self._of = ctypes.addressof(self._shapes)

    def bounds(
        self, frames: Array, pairs: Indices, within: float, known: Array | None
    ) -> tuple[Array, Indices, Indices]:
        """Lower bounds (n, p) [m] on the distances of `pairs` (p,), and where (k,) they are at most
        `within`: rows and columns.

        They are those of balls, improved by beads if `within` is finite, or `known` (n, p) ones
        where these are greater than `within`. A ball cannot enclose a half-space: its pairs get
        -inf.
        """
        n, p = len(frames), len(pairs)
        distance = np.empty((n, p)) if known is None else known.copy()
        row, column = np.empty(n * p, dtype=np.intp), np.empty(n * p, dtype=np.intp)
        room = np.empty((self._bodies, 3))
        given = _plain(frames), _plain(pairs)
        found = library.bounds(
            self._of,
            n,
            address(given[0]),
            p,
            address(given[1]),
            within,
            known is not None,
            *map(address, (distance, row, column, room)),
        )
        return distance, row[:found], column[:found]

    def bead_bounds(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds (k,) [m] on the signed distances of pairs (k,) at configurations (k,), by
        beads that cover one body, against the box or cylinder of the other.

        The ball around a board is as large as the board is long, and much of a cell lies within it.
        The distance of a few beads bounds that of the bodies almost as well as the exact one, for a
        fraction of the time. Pairs without a box or a cylinder get -inf, and so do those whose
        cores may overlap.
        """
        result = np.empty(len(pair))
        self._call(library.bead_bounds, frames, configuration, pair, result)
        return result

    def witness_points(
        self, frames: Array, configuration: Indices, pair: Indices
    ) -> tuple[Array, Array, Array]:
        """Signed distance of the cores (k,) [m], normal and point (k, 3), as of
        `PairGeometry.witness_points`.

        The distance is NaN where Coal or a cloud has to compute it.
        """
        k = len(pair)
        distance, normal, point = np.empty(k), np.empty((k, 3)), np.empty((k, 3))
        self._call(library.witness_points, frames, configuration, pair, distance, normal, point)
        return distance, normal, point

    def separations(
        self,
        frames: Array,
        begin: Indices,
        end: Indices,
        pair: Indices,
        normals: tuple[Array, Array],
    ) -> Array:
        """Separations (k,) [m] of pairs (k,) that hold at the configurations `begin` and at `end`
        (k,).

        The separation along a unit vector n is min n·x over the second body - max n·x over the
        first: it never exceeds the signed distance. For a half-space, n must be its outward normal.
        Unit `normals` (k, 3) at both configurations move with the first body: the better one
        counts, by the lesser of its separations.
        """
        result = np.empty(len(pair))
        self._call(library.separations, frames, begin, end, pair, *normals, result)
        return result

    def supports(
        self, frames: Array, configuration: Indices, body: Indices, normal: Array
    ) -> Array:
        """min n·x (k,) [m] over the cores of bodies (k,), for unit vectors n (k, 3) in the base
        frame.
        """
        result = np.empty(len(body))
        self._call(library.supports, frames, configuration, body, normal, result)
        return result

    def gradients(
        self, frames: Array, configuration: Indices, pair: Indices, normal: Array, point: Array
    ) -> Array:
        """Gradients (k, nq) [m/rad] of signed distances: n · (axis × (point - origin)) of every
        joint in between.
        """
        result = np.empty((len(pair), self._nq))
        self._call(library.gradients, frames, configuration, pair, normal, point, result)
        return result

    def _call(self, function: Any, frames: Array, *arrays: Array | Indices) -> None:
        """Call a function about as many cases as the arrays are long; the last ones are its
        results.
        """
        given = [_plain(each) for each in (frames, *arrays)]
        function(self._of, address(given[0]), len(given[1]), *map(address, given[1:]))


def _plain(array: Array | Indices) -> Array | Indices:
    """The array as C knows it: numbers one after the other, 64 bits each."""
    kind = float if array.dtype == float else np.intp
    return np.ascontiguousarray(array, dtype=kind)
