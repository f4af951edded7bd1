"""The terms of dual bounds in numpy, as references for the C library."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.cruise import TINY
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.grid_cells import GridCells
from joulepath.optimizer.bounds.least_potential import LeastPotential, _excess, _hold, _weight
from joulepath.optimizer.bounds.path_curvature import DIFFERENCE_STEP
from joulepath.optimizer.bounds.path_terms import GridPoints
from joulepath.optimizer.bounds.speed_conjugate import BISECTIONS, SpeedConjugate, TimeParts
from joulepath.optimizer.bounds.weights import Weights


def grid_points(
    chain: ChainDerivatives, x: Array, omega: Array, offsets: Array, needed: Mask
) -> GridPoints:
    """As `GridPoints.of`."""
    S, K = len(x) - 1, len(offsets)
    x_rate, omega_rate = np.diff(x, axis=0) * S, np.diff(omega, axis=0) * S
    q, flat = (x[:, None] + offsets)[needed], needed.ravel()

    def placed(values: Array) -> Array:
        every = np.zeros((flat.size, *values.shape[1:]))
        every[flat] = values
        return every.reshape(S + 1, K, *values.shape[1:])

    torque, slope = map(placed, chain.gravity_torque(q))
    own = chain.joint_inertia(q)
    beside = chain.joint_inertia(q + DIFFERENCE_STEP * np.repeat(omega, K, axis=0)[flat])
    M, N = placed(own), placed((beside - own) / DIFFERENCE_STEP)
    momentum = _sides(
        lambda at: (
            np.einsum("spjk,sk->spj", M[at], omega_rate) + np.einsum("spjk,sk->spj", N[at], x_rate)
        )
    )
    kinetic = _sides(
        lambda at: (
            np.einsum("sj,spjk,sk->sp", omega_rate, M[at], x_rate)
            + np.einsum("sj,spjk,sk->sp", x_rate, N[at], x_rate) / 2
        )
    )
    diagonal = np.einsum("npjj->npj", N)
    return GridPoints(
        _sides(lambda at: np.einsum("sj,spj->sp", omega[at], torque[at])),
        _sides(lambda at: np.einsum("sj,spjk->spk", omega[at], slope[at])),
        kinetic,
        momentum,
        (np.abs(N).sum(axis=-1) - np.abs(diagonal) + np.maximum(diagonal, 0.0)).max(axis=1),
    )


def _sides(term: Callable[[slice], Array]) -> Array:
    """A nodal term at both ends of every step, shape (S, 2, ...)."""
    return np.stack([term(slice(None, -1)), term(slice(1, None))], axis=1)


def _of_corners(cells: GridCells, points: Array, reduce: Callable[[Array, Array], Array]) -> Array:
    """Reduction of corner values (..., points, k) to the values of the cells (..., cells, k)."""
    n, m = map(len, cells.axes)
    value = points.reshape(*points.shape[:-2], n, m, points.shape[-1])
    value = reduce(value[..., 1:, :, :], value[..., :-1, :, :])
    value = reduce(value[..., 1:, :], value[..., :-1, :])
    return value.reshape(*points.shape[:-2], cells.count, points.shape[-1])


def _between(cells: GridCells, second: Array) -> Array:
    """Σ h² / 8 · second (S, 2, k) over the sides of the cells, shape (S, cells, k)."""
    first, other = (np.diff(axis) ** 2 / 8 for axis in cells.axes)
    both = (
        second[:, 0, None, None] * first[:, None, None] + second[:, 1, None, None] * other[:, None]
    )
    return np.asarray(both.reshape(len(second), cells.count, second.shape[-1]))


def least_potential(potential: LeastPotential, weights: Weights, fast: Array, slow: Array) -> Array:
    """As `LeastPotential.__call__`."""
    terms, scale, hold = potential.terms, weights.scale, _hold(weights)
    cells, grid = terms.cells, list(terms.grid)
    positions = cells.points()
    square = positions**2 @ hold[grid] / 2 - scale * terms.kinetic  # by 1 / T²
    along = terms.slope[:, grid] @ positions.T
    excess = _excess(fast, slow)[:, None, None] * along
    f2, s2 = (each[:, None, None, None] ** 2 for each in (fast, slow))
    still = scale * (terms.gravity - (along + np.maximum(excess, 0.0))[:, :, None])
    corner = still + np.minimum(f2 * square, s2 * square)
    b2 = fast[:, None, None] ** 2
    bend = (
        scale * (terms.gravity_curvature.across + b2 * terms.kinetic_curvature.across)
        + b2 * hold[grid]
    )
    flat = scale * (terms.gravity_curvature.along + b2[..., 0] * terms.kinetic_curvature.along)
    value = _of_corners(cells, corner[..., None], np.minimum)[..., 0]
    value -= np.stack([_between(cells, each[..., None])[..., 0] for each in bend])[:, :, None]
    value -= flat[:, :, None, None] + f2 * (terms.deviation**2 @ _weight(weights))
    value += cells.beyond(terms.half[:, grid])[:, None]
    value -= _beside(potential, weights, fast, slow)
    return np.asarray(value.min(axis=-1).mean(axis=-1))


def _beside(potential: LeastPotential, weights: Weights, fast: Array, slow: Array) -> Array:
    """Largest decrease of Ψ by the joints outside the grid, shape (B, S, 2, cells) [W]."""
    terms, scale, b2, hold = potential.terms, weights.scale, fast[:, None] ** 2, _hold(weights)
    taken, cross_terms = (
        np.zeros((len(fast), *terms.steepness.shape[:-1])),
        potential._cross(weights),
    )
    for i, joint in enumerate(terms.others):
        stiffness = hold[joint] * slow[:, None] ** 2 - scale * terms.gravity_others[:, i]
        stiffness = (stiffness - b2 * cross_terms[:, i])[:, :, None, None]
        more = (
            _excess(fast, slow)[:, None] * np.abs(terms.slope[:, joint])
            + b2 * terms.kinetic_others[:, i]
        )
        s = scale * (terms.steepness[..., i] + more[:, :, None, None])
        stable, half = stiffness > 0, terms.half[:, joint, None, None]
        far = np.where(stable, np.minimum(s / np.where(stable, stiffness, 1.0), half), half)
        taken += s * far - stiffness * far * far / 2
    return taken


def greatest(
    friction: FrictionConjugate, p: Array, omega: Array, square: Array, most: Array
) -> tuple[Array, Array]:
    """The upper bounds of `greatest` in `speed_conjugate.c` and the maximisers, both (..., nq)."""
    shape = np.broadcast_shapes(p.shape, omega.shape, square.shape, most.shape)
    best, where = np.zeros(shape), np.zeros(shape)
    limit = most[..., None, :]
    low, high = np.minimum(friction.first, limit), np.minimum(friction.last, limit)
    second = square[..., None, :] - friction.slope
    bent = second < 0
    fastest = (friction.constant + friction.slope * friction.last)[-1]
    for way in (1.0, -1.0):
        sign = way * np.where(p < 0, -1.0, 1.0)
        shift = sign * omega
        if friction.load is not None:
            shift = shift / np.where(shift > 0, 1 + friction.load, 1 - friction.load)
        reach = np.maximum((sign * p + np.maximum(square, 0.0) * most) * most, 0.0)
        reach = reach + np.maximum(-shift, 0.0) * fastest
        shift = np.broadcast_to(shift, shape)[..., None, :]
        rate = (sign * p)[..., None, :] - friction.constant - shift * friction.slope
        v = np.clip(np.where(bent, -rate / np.where(bent, 2 * second, -1.0), high), low, high)
        value = np.maximum((second * v + rate) * v, (second * low + rate) * low)
        value = value - shift * friction.constant
        value = value + np.maximum(-(friction.first + shift), 0.0) * friction.sagitta
        value = np.where(friction.first <= limit, value, -np.inf)
        k = value.argmax(axis=-2)[..., None, :]
        own = np.take_along_axis(value, k, axis=-2)[..., 0, :]
        at = np.take_along_axis(np.broadcast_to(v, value.shape), k, axis=-2)[..., 0, :]
        better = (own > best) & ((way > 0) | (reach > best))
        best, where = np.where(better, own, best), np.where(better, sign * at, where)
    return best, where


def speed_conjugate(conjugate: SpeedConjugate, weights: Weights) -> tuple[Array, Array]:
    """As `SpeedConjugate.__call__`."""
    parts, duration, terms = conjugate._parts, conjugate.duration, conjugate.terms
    scale = weights.scale
    m_first, m_last = _multiplier(conjugate, weights, 0), _multiplier(conjugate, weights, -1)
    share = (1 / duration - 1 / duration[-1]) / max(1 / duration[0] - 1 / duration[-1], TINY)
    m = m_last + share[:, None] * (m_first - m_last)
    T = duration[:, None, None]
    p = scale * T[..., None] * _ends(parts, conjugate._costate) + m[:, None, None]
    p = p + (scale * terms.momentum / T)[:, parts.step, None]
    b = (terms.x_rate / T)[:, parts.step, None]
    stiffness = (weights.confinement + weights.mixing + scale * terms.spread)[parts.step, None]
    omega = scale * _ends(parts, terms.omega)
    most = parts.speed[:, :, None]
    height = _height(conjugate, weights, p, omega, b, stiffness, most)[0]
    along = (p.mean(axis=2) * (terms.x_rate[parts.step] * parts.length[:, None])).sum(axis=(1, 2))
    return (height.mean(axis=2) * parts.length[:, None]).sum(axis=(1, 2)), along


def _ends(parts: TimeParts, nodes: Array) -> Array:
    """Interpolated values (P, 2, nq) at both ends of the parts, from nodes (steps + 1, nq)."""
    first, last = nodes[parts.step, None], nodes[parts.step + 1, None]
    return np.asarray(first + parts.within[..., None] * (last - first))


def _multiplier(conjugate: SpeedConjugate, weights: Weights, which: int) -> Array:
    """Multiplier m (nq,) [N·m] for the first or last duration.

    The speeds of H at m cover the displacement.
    """
    terms, duration, costate = conjugate.terms, conjugate.duration[which], conjugate._costate
    scale, friction = weights.scale, conjugate.friction
    b, omega = terms.x_rate / duration, scale * (terms.omega[1:] + terms.omega[:-1]) / 2
    p = scale * (duration * (costate[1:] + costate[:-1]) / 2 + terms.momentum / duration)
    stiffness = weights.confinement + weights.mixing + scale * terms.spread
    torque = (friction.constant + friction.slope * friction.last)[-1]
    reach = 4 * torque + np.abs(p).max(axis=0) + stiffness.max(axis=0) * friction.last[-1]
    low, high = -reach, reach
    for _ in range(BISECTIONS):
        m = (low + high) / 2
        v = _height(conjugate, weights, p + m, omega, b, stiffness, conjugate._mean[which])[1]
        short = duration * v.sum(axis=0) < terms.x_rate.sum(axis=0)
        low, high = np.where(short, m, low), np.where(short, high, m)
    return np.asarray((low + high) / 2)


def _height(
    conjugate: SpeedConjugate,
    weights: Weights,
    p: Array,
    omega: Array,
    b: Array,
    stiffness: Array,
    most: Array,
) -> tuple[Array, Array]:
    """The maximum H (..., nq) [W] and its maximiser.

    The arguments are p, ω, the speeds b of the path, κ + μ + ν, and the greatest speeds.
    """
    more, slowness = 1 + 2 * weights.work, conjugate._slowness(weights)
    linear = p - stiffness * b + slowness * omega
    square = stiffness / 2 + weights.work * slowness
    # (1 + 2 η) v + ω is more · (v + ω / more)
    value, v = greatest(conjugate.friction, linear / more, omega / more, square / more, most)
    return more * value - p * b + stiffness * b * b / 2, v
