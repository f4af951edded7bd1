"""Advice on the next measurement, ordered by the shares of figures in the variance of an energy.

The variance equals the one of the answers: identified figures contribute their covariance, others
their prior ranges. Exact knowledge of a figure would reduce the variance of the energy by the share
of the squared correlation between both. The diagonal term of a figure is no measure of its
influence: errors of figures compensate each other, so a single term can exceed the total variance.
The figures are selected one by one. Every selection conditions the covariance on the figures
selected before, so that a shared error counts once.

The standard deviation of a figure falls with the square root of the time in motion: halving it
takes four times the moves (Verdonck 2004, Radkhah 2007: the excitation determines how well a log
determines a figure).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.uncertainty.parameters import BASE_POWER, LINKS, index, place
from joulepath.models.uncertainty.spread import SESSION
from joulepath.optimizer.identify.estimates.grouped import IntArray
from joulepath.optimizer.identify.quality.answered import AnsweredEnergies
from joulepath.optimizer.identify.results import Advice
from joulepath.optimizer.identify.rows.fit_rows import Rows

INERTIALS = "inertials"
_LOGGING_ADVICE = {
    "coulomb": "Log slow and fast moves of this joint, in both directions.",
    "viscous": "Log moves of this joint near its greatest speed.",
    "load": "Log slow moves of this joint with the arm stretched out and folded, or with a "
    "payload.",
    "curved": "Log moves of this joint at several constant speeds.",
    "rotor_inertia": "Log moves in which this joint accelerates as fast as it may.",
    "torque_constant": "Log motor currents of slow moves with a known payload, the arm stretched "
    "out and folded.",
    "idle_power": "Log ten seconds at rest with the power of the arm's bus, the arm stretched "
    "straight up, so that its joints carry little.",
    "copper": "Log the arm at rest stretched out and folded, with its power: the current that "
    "holds it differs.",
    INERTIALS: "Log moves that lift the arm and lower it, with its currents or torques.",
    "inverter_linear": "Log the arm at rest in poses of different load, with its power.",
}
_OF_DRIVES = ("coulomb", "viscous", "curved", "load", "rotor_inertia")
_BEHIND_GEARS = (
    "Log motor currents, or the power of the arm's bus: torques that were measured behind the "
    "gears contain neither friction nor rotors."
)


@dataclass(frozen=True)
class AdviceSettings:
    """Settings of the advice."""

    min_share: float = 0.01
    """Share below which a figure is not named after the first [1]."""
    most: int = 8
    """Largest number of figures that are named."""


ADVICE = AdviceSettings()


def advice_of(energies: AnsweredEnergies, rows: Rows) -> tuple[Advice, ...]:
    """Select the figures to measure better for motions like the given rows.

    Args:
        energies: energies of the fitted arm and their uncertainty, as in the answers.
        rows: rows of the motions.

    Returns:
        Advice per figure, the greatest share of the variance first; empty if the variance is not
        positive and finite.
    """
    gradient, total = energies.gradient(rows), energies.variance(rows)
    if not np.isfinite(total) or total <= 0:
        return ()
    spread = energies.spread.covariances.items()
    figures = np.sum([each for name, each in spread if name != SESSION], axis=0)
    behind = rows.link_side and not np.isfinite(rows.power).any()
    found = list[Advice]()
    candidates = [*_figures(energies.arm.robot.nq, len(gradient))]
    while len(found) < ADVICE.most:
        explained = [_explained(figures, gradient, at) for *_, at in candidates]
        best = int(np.argmax(explained))
        name, joint, at = candidates.pop(best)
        if found and explained[best] < ADVICE.min_share * total:
            break
        do = _BEHIND_GEARS if behind and name in _OF_DRIVES else _LOGGING_ADVICE[name]
        found.append(Advice(name, joint, explained[best] / total, do))
        figures = figures - _determined(figures, at)
    return tuple(found)


def _figures(nq: int, size: int) -> Iterator[tuple[str, int | None, IntArray]]:
    """Name, joint and indices in the vector (size,) for all figures a log can determine."""
    for name in _LOGGING_ADVICE:
        if name == "idle_power":
            yield name, None, np.arange(size)[place(BASE_POWER, nq)]
        elif name == INERTIALS:
            first = index(LINKS[0], 0, nq)
            yield name, None, np.arange(first, max(first, size))
        else:
            for joint in range(nq):
                yield name, joint, np.array([index(name, joint, nq)])


def _explained(covariance: Array, gradient: Array, at: IntArray) -> float:
    """Reduction of the variance [J²] by exact knowledge of the figures at the indices `at` (k,)."""
    shared, inverse = _shared(covariance, at)
    by_figures = gradient @ shared
    return float(by_figures @ inverse @ by_figures)


def _determined(covariance: Array, at: IntArray) -> Array:
    """Reduction of the covariance (p, p) by exact knowledge of the figures at `at` (k,)."""
    shared, inverse = _shared(covariance, at)
    return np.asarray(shared @ inverse @ shared.T)


def _shared(covariance: Array, at: IntArray) -> tuple[Array, Array]:
    """Covariance (p, k) of all figures with those at `at` of unit variance, and the inverse (k, k)
    of the correlation of the latter; figures without a variance are left out.
    """
    sd = np.sqrt(np.maximum(covariance[at, at], 0.0))
    at, sd = at[sd > 0], sd[sd > 0]
    correlation = covariance[np.ix_(at, at)] / np.outer(sd, sd)
    return covariance[:, at] / sd, np.linalg.pinv(correlation, hermitian=True)
