"""What the efforts of a log are: their slope against the torque of the rigid model tells."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.logs.motion import Motion, thinned

_MOST_ROWS = 4000  # that the slope is taken from
_KNEE = 0.02  # rad/s over which the sign of the speed is smoothed
# of the torque limit: standard deviation of the rigid torque beyond which it tells a slope
_LEAST_TORQUE = 0.01
_EXTERNAL = 0.5  # slope · torque constant below which efforts are without gravity
_NEAR = 1.6  # factor within which a slope is that of a meaning


@dataclass(frozen=True)
class EffortReport:
    """What the efforts of a log are.

    `slope` is that of the effort against the torque of the rigid body and rotor model, with
    friction beside it, at the two joints (by name) that carry most of the gravity: about 1 / torque
    constant for currents [A], 1 for torques, 0 for efforts without gravity; None where the motion
    does not tell. `confidence` is 1 where the slopes are those of the meaning, 0 where they could
    as well be another's, or do not tell.
    """

    meaning: EffortMeaning | None
    confidence: float
    slope: dict[str, float | None]


def effort_report(motion: Motion, effort: Array) -> EffortReport:
    """What efforts (n, joints) of a motion are."""
    rows = thinned(len(effort), _MOST_ROWS)
    part, effort, robot = motion.at(rows), effort[rows].astype(float), motion.robot
    rigid, still = part.rigid_torques(), np.zeros_like(part.q)
    weights = replace(part, v=still, a=still).rigid_torques()
    # of those next to the base: at a wrist, cables and friction outweigh what it carries
    heaviest = np.sort(np.argsort(-weights[:, : (robot.nq + 1) // 2].std(axis=0))[:2])
    slopes = {
        int(j): _slope(rigid[:, j], part.v[:, j], effort[:, j], robot.limits.tau_max[j])
        for j in heaviest
    }
    judged = [
        _judged(slope, robot.drives.torque_constant[j])
        for j, slope in slopes.items()
        if slope is not None
    ]
    meanings = {meaning for meaning, _ in judged}
    meaning = meanings.pop() if len(meanings) == 1 else None
    return EffortReport(
        meaning=meaning,
        confidence=min((confidence for _, confidence in judged), default=0.0) if meaning else 0.0,
        slope={robot.joint_names[j]: slope for j, slope in slopes.items()},
    )


def _slope(rigid: Array, v: Array, effort: Array, limit: float) -> float | None:
    """Slope of effort (n,) against the rigid torque (n,), with Coulomb and viscous friction and an
    offset beside it.
    """
    beside = np.stack([v / np.sqrt(v * v + _KNEE * _KNEE), v, np.ones_like(v)], axis=1)
    # what the other columns do not explain of both: the slope of a multiple regression (Frisch,
    # Waugh, Lovell)
    rest, other = (x - beside @ np.linalg.lstsq(beside, x, rcond=None)[0] for x in (rigid, effort))
    if rest.std() < _LEAST_TORQUE * limit:
        return None
    return float(rest @ other / (rest @ rest))


def _judged(slope: float, torque_constant: float) -> tuple[EffortMeaning | None, float]:
    """The meaning that a slope speaks for, and how clearly, from 0 to 1."""
    if abs(slope) * torque_constant < _EXTERNAL and abs(slope) < 1 / _NEAR:
        return "external", 1 - abs(slope) * torque_constant / _EXTERNAL
    off = {
        meaning: _away(slope, at)
        for meaning, at in (("current", 1 / torque_constant), ("torque", 1.0))
    }
    nearest = min(off, key=off.__getitem__)
    clear = 1 - off[nearest]
    # where both are near, the torque constant is about 1, and only the name of the column can tell
    if clear <= 0 or max(off.values()) < 1:
        return None, 0.0
    return ("current" if nearest == "current" else "torque"), clear


def _away(slope: float, expected: float) -> float:
    """How far a slope is from an expected one: 0 where it is the same, 1 at the factor _NEAR."""
    return float(abs(np.log(slope / expected)) / np.log(_NEAR)) if slope > 0 else np.inf
