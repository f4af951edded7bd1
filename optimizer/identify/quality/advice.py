"""What to measure next, in the order of its share in the interval of an energy.

The interval is that of the answers: of identified figures by their covariance, and of all others by
the ranges that they have before any log. If a figure were known, the variance of the energy would
fall by the share of their squared correlation. Errors of figures compensate each other, so the term
of a single figure in the variance can exceed the whole variance and is no measure. Each further
share is that of a figure beside those before it, so errors that figures share count once.

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
    "rotor_inertia": "Log moves in which this joint speeds up as fast as it may.",
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
    """The figures to measure better for motions like those of the rows, the most useful first.

    Args:
        energies: energies of the fitted arm, as answers have them.
        rows: rows of the motions.
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
    """Name, joint and places in the vector (size,) of each figure that a log can determine."""
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
    """Variance [J²] that vanishes if the figures at these places (k,) are known."""
    return float(gradient @ _determined(covariance, at) @ gradient)


def _determined(covariance: Array, at: IntArray) -> Array:
    """Part of the covariance (p, p) that vanishes if the figures at these places (k,) are known."""
    sd = np.sqrt(np.maximum(np.diag(covariance)[at], 0.0))
    at, sd = at[sd > 0], sd[sd > 0]
    correlation = covariance[np.ix_(at, at)] / np.outer(sd, sd)
    shared = covariance[:, at] / sd
    return np.asarray(shared @ np.linalg.pinv(correlation, hermitian=True) @ shared.T)
