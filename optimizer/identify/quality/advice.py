"""Which figure to measure better: the one that would take the largest share of the energy's
variance away.

If a figure were known, the variance would fall by the square of its correlation with the energy.
Errors of figures make up for each other: a figure's own term of the variance can be larger than the
whole, and tells less.


The standard deviation of a figure falls with the square root of the time in motion (Verdonck 2004,
Radkhah 2007: what a log tells of a figure depends on how it excites it). To halve it takes four
times the moves.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.fits.fitting import LINK_MASS_SCALE, Fitted
from joulepath.optimizer.identify.results import Advice
from joulepath.optimizer.identify.rows.fit_rows import Rows

_DO = {
    "coulomb": "Log slow and fast moves of this joint, in both directions.",
    "viscous": "Log moves of this joint near its greatest speed.",
    "load": "Log slow moves of this joint with the arm stretched out and folded, or with a "
    "payload.",
    "curved": "Log moves of this joint at several constant speeds.",
    "rotor_inertia": "Log moves in which this joint speeds up as fast as it may.",
    "idle_power": "Log some seconds of rest, and the power of the arm's bus.",
    "copper": "Log the arm at rest stretched out and folded, with its power: the current that "
    "holds it differs.",
    LINK_MASS_SCALE: "Log moves that lift the arm and lower it, with its power; or its currents or "
    "torques.",
    "inverter_linear": "Log the arm at rest in poses of different load, with its power.",
}
STEP = 1e-4


def advice_of(fitted: Fitted, rows: Rows) -> Advice | None:
    """The figure to measure, for motions like those of the logs; None without power figures to
    weigh them by.
    """
    names, covariance = fitted.estimate.names, fitted.estimate.covariance
    known = [k for k, (name, _) in enumerate(names) if name in _DO]
    gradient = np.array([slope(fitted.arm, rows, *names[k]) for k in known])
    part = covariance[np.ix_(known, known)]
    together, total = part @ gradient, float(gradient @ part @ gradient)
    if not np.isfinite(total) or total <= 0:
        return None
    own = np.diag(part)
    shares = np.where(own > 0, together**2 / np.where(own > 0, own * total, 1.0), 0.0)
    worst = int(np.argmax(shares))
    name, joint = names[known[worst]]
    return Advice(name, joint, float(shares[worst]), _DO[name])


def slope(arm: FittedArm, rows: Rows, name: str, joint: int | None) -> float:
    """Derivative of the energy [J] of the rows by a figure."""
    return (_energy(_changed(arm, name, joint, STEP), rows) - _energy(arm, rows)) / STEP


def _energy(arm: FittedArm, rows: Rows) -> float:
    return float(rows.weight @ arm.power(rows)[0])


def _changed(arm: FittedArm, name: str, joint: int | None, by: float) -> FittedArm:
    electrics, changed = arm.electrics, dict[str, Any]()
    if name == LINK_MASS_SCALE:
        return replace(arm, links=arm.links + by)
    if joint is None:
        return replace(arm, electrics=replace(electrics, idle=electrics.idle + by))
    if name in ("copper", "inverter_linear"):
        part = name.removesuffix("_linear")
        changed[part] = _raised(getattr(electrics, part), joint, by)
        return replace(arm, electrics=replace(electrics, **changed))
    changed[name] = _raised(getattr(arm, name), joint, by)
    return replace(arm, **changed)


def _raised(values: Array, joint: int, by: float) -> Array:
    result = values.copy()
    result[joint] += by
    return result
