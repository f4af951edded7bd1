"""Kinds of pairs of configurations: pairs that differ only by common full turns."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.prepared_problem import PreparedProblem


def kinds_of(
    start: Layer, goal: Layer, prepared: PreparedProblem
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Kind (s, g) of every pair, and the pair (k, 2) of every kind farthest from the limits."""
    lowest, highest = (f(np.vstack([start.turns, goal.turns]), axis=0) for f in (np.min, np.max))
    base = 2 * (highest - lowest) + 1
    place = np.concatenate([[1], np.cumprod(base[:-1])])
    turned = (goal.turns @ place)[None, :] - (start.turns @ place)[:, None]
    ends = start.end[:, None] * len(goal.ends) + goal.end[None, :]
    code = ends * (2 * int(np.abs(turned).max(initial=0)) + 1) + turned
    limits = prepared.arm.active_limits
    middle, half = (limits.q_max + limits.q_min) / 2, (limits.q_max - limits.q_min) / 2
    edge = [(np.abs(layer.q - middle) / half).max(axis=1) for layer in (start, goal)]
    order = np.argsort(np.maximum(edge[0][:, None], edge[1][None, :]), axis=None, kind="stable")
    _, first, kind = np.unique(code.ravel()[order], return_index=True, return_inverse=True)
    of_pair = np.empty(code.size, dtype=np.intp)
    of_pair[order] = kind
    return of_pair.reshape(code.shape), np.column_stack(np.unravel_index(order[first], code.shape))


def displacements_between(
    prepared: PreparedProblem, start: Layer, goal: Layer, pair: npt.NDArray[np.intp]
) -> tuple[Array, Array]:
    """Displacements (k, nq) [rad] of pairs (k, 2), and potential energies (k, 2) [J] at their
    ends.
    """
    ends = [(layer, layer.end[nodes]) for layer, nodes in zip((start, goal), pair.T, strict=True)]
    levels = [
        np.array([prepared.potential(end.q) for end in layer.ends])[own] for layer, own in ends
    ]
    return goal.q[pair[:, 1]] - start.q[pair[:, 0]], np.column_stack(levels)
