"""Decides whether a term takes its estimate or keeps the robot's own value.

An undetermined term keeps the robot's own value, with two exceptions: the logs reject this value,
or its standard deviation is larger than the deviation of the estimate. Engineering defaults are
right within a factor of three.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    column_lengths,
    jackknife,
    leave_one_out,
)
from joulepath.optimizer.identify.fits.block import SCALE


@dataclass(frozen=True)
class DeterminedSettings:
    """Limits for a determined term."""

    max_relative_sd: float = 0.3
    """Largest ratio of an identified figure's standard deviation to its value [1]."""
    max_sd_ratio: float = 0.7
    """Largest ratio of a figure's standard deviation after the logs to the deviation before, at
    which the logs count as informative [1]: they then halve the variance."""
    least_scale: float = 0.2
    """Smallest plausible factor on the robot's own torque constants [1]. The constants are wrong
    by some tens of per cent at most."""
    most_load: float = 0.999
    """Largest plausible load friction [1]; a drive with a load friction of 1 does not move."""
    rejecting_sds: float = 4.0
    """Distance from the estimate [standard deviations] beyond which an own value is rejected."""


DETERMINED = DeterminedSettings()
NOT_MOVING = "The joint hardly moves in these logs."
UNCERTAIN = "Its standard deviation is {:.0%} of its value."
NOT_TOLD = "The logs do not separate it from other figures."
IMPOSSIBLE = "The fit gives {:.3g}, which is implausible for a drive."
LAW_KEPT = "The joint's Coulomb friction is kept, and so is the rest of its law."
AT_BOUND = "The fit gives its bound, {:g}."
REJECTED = (
    "{} The robot's own value is {:.0f} standard deviations away, so that it is not kept: check "
    "the payload, the links, the torque constants, zeros and signs of the positions, and the side "
    "of torques (`torque_side`)."
)

LESS_KNOWN = (
    "{} The robot's own value, {:.3g}, has a standard deviation of {:.2g} and is known even less "
    "well, so that it is not kept."
)


def reason_of(value: float, sd: float) -> str:
    """Reason why a figure does not count as identified; empty for an identified figure."""
    if value == 0 or sd == 0:
        return AT_BOUND.format(value)
    if not np.isfinite(sd):
        return NOT_TOLD
    relative = sd / abs(value)
    return "" if relative <= DETERMINED.max_relative_sd else UNCERTAIN.format(relative)


def with_reasons(found: Estimate, judged: Iterable[int]) -> Estimate:
    """The estimate, with a reason for every unidentified figure among the `judged` indices."""
    deviations, reasons = np.sqrt(np.diag(found.covariance)), [*found.reasons]
    for k in judged:
        reasons[k] = reasons[k] or reason_of(float(found.value[k]), float(deviations[k]))
    return replace(found, reasons=tuple(reasons))


@dataclass(frozen=True, eq=False)
class Unbounded:
    """Solutions for p unknowns, with the own bound of an unknown lifted for its solution."""

    value: Array
    """Values (p,). For the value of an unknown, its bound is lifted and all other bounds hold."""
    replicates: Array
    """Values (G, p) after leaving out one group of equations, around the bounded values."""
    undetermined: Mask
    """Unknowns (p,) left undetermined by the logs if some group is left out."""

    @property
    def sd(self) -> Array:
        """Standard deviations (p,), infinite for undetermined unknowns."""
        return np.where(self.undetermined, np.inf, np.sqrt(np.diag(jackknife(self.replicates))))


def unbounded(
    grouped: GroupedEquations,
    value: Array,
    inside: Mask,
    bounded: Mask,
    gradient: Array,
    prior: Array | None = None,
) -> Unbounded:
    """Solve again for every unknown at its bound, with this bound lifted.

    Args:
        grouped: normal equations of the G groups.
        value: bounded solution (p,).
        inside: estimated unknowns (p,) away from their bounds.
        bounded: estimated unknowns (p,) at their bounds; the remaining unknowns are known.
        gradient: gradient (p,) of the sum of squares at the solution.
        prior: precision (p, p) of a prior.
    """
    lifted, (replicates, undetermined) = value.copy(), leave_one_out(grouped, value, inside, prior)
    total = grouped.total(0.0 if prior is None else prior).gram
    for k in np.flatnonzero(bounded):
        free = inside.copy()
        free[k] = True
        at = np.flatnonzero(free)
        place = int(np.searchsorted(at, k))
        scale = column_lengths(total[np.ix_(at, at)])
        inverse = np.linalg.pinv(total[np.ix_(at, at)] / np.outer(scale, scale), hermitian=True)
        step = -inverse[:, place] / scale * (gradient[k] / scale[place])
        moved = value.copy()
        moved[at] += step
        lifted[k] = moved[k]
        without = leave_one_out(grouped, moved, free, prior)
        replicates[:, k] = value[k] + without.estimates[:, k] - moved[k]
        undetermined[k] = without.undetermined[k]
    return Unbounded(lifted, replicates, undetermined)


def impossible(names: Sequence[Name], value: Array) -> Mask:
    """Terms (p,) with impossible values (p,): too small a factor on the torque constant, or a load
    friction at which the drive does not move.
    """
    term = np.array([name[0] for name in names])
    too_small = (term == SCALE) & (value < DETERMINED.least_scale)
    return np.asarray(too_small | ((term == "load") & (value > DETERMINED.most_load)))


def rejections(value: Array, sd: Array, own: Array) -> Array:
    """Distances (p,) of rejected own values from the estimates, in standard deviations.

    The distance is 0 for all own values (p,) that the logs do not reject.
    """
    distance = np.abs(own - value) / np.where(sd > 0, sd, np.inf)
    return np.where(distance > DETERMINED.rejecting_sds, distance, 0.0)


def remarks_of(
    reasons: Sequence[str], value: Array, sd: Array, own: Array, own_sd: Array
) -> list[str]:
    """Reasons (p,) why the robot's own values of doubted terms are not kept; empty for other terms.

    Args:
        reasons: reasons (p,) for a doubt, or empty.
        value: estimates (p,) without bounds; estimates below the bound 0 replace no own value.
        sd: standard deviations (p,) of the estimates; infinite: replaces no own value.
        own: the robot's own values (p,).
        own_sd: standard deviations (p,) of the own values; 0 for values kept unless rejected.
    """
    rejected = rejections(value, sd, own)
    better = (value > 0) & (sd <= DETERMINED.max_sd_ratio * own_sd) & (own_sd > 0)
    remarks = [""] * len(reasons)
    for k, reason in enumerate(reasons):
        if reason and rejected[k]:
            remarks[k] = REJECTED.format(reason, rejected[k])
        elif reason and better[k]:
            remarks[k] = LESS_KNOWN.format(reason, own[k], own_sd[k])
    return remarks
