"""Decides whether a term takes its estimate or keeps the robot's own value.

An undetermined term keeps the robot's own value, unless the logs reject this value, or it is known
even less well than the estimate: engineering defaults are right within a factor of three.
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
    """Largest standard deviation of an identified figure over its value [1]."""
    max_sd_ratio: float = 0.7
    """Largest standard deviation of a figure over that before the logs, at which the logs tell
    something of it [1]: half of the variance."""
    least_scale: float = 0.2
    """Smallest plausible factor on the robot's own torque constants [1], whose errors are some
    tens of per cent at most."""
    most_load: float = 0.999
    """Largest plausible load friction [1]; a drive with a load friction of 1 does not move."""
    rejecting_sds: float = 4.0
    """Distance of a rejected own value from the estimate, in standard deviations [1]."""


DETERMINED = DeterminedSettings()
NOT_MOVING = "The joint hardly moves in these logs."
UNCERTAIN = "Its standard deviation is {:.0%} of its value."
NOT_TOLD = "The logs do not tell it from other figures."
IMPOSSIBLE = "The fit puts it at {:.3g}, which no drive has."
LAW_KEPT = "The joint's Coulomb friction is kept, and so is the rest of its law."
AT_BOUND = "The fit puts it at its bound, {:g}."
REJECTED = (
    "{} The robot's own value, {:.3g}, is {:.0f} standard deviations away, so that it is not kept: "
    "check the links, the torque constants and the payload."
)

LESS_KNOWN = (
    "{} The robot's own value, {:.3g}, has a standard deviation of {:.2g} and is known even less "
    "well, so that it is not kept."
)


def reason_of(value: float, sd: float) -> str:
    """Reason for not counting a figure as identified; empty if it is."""
    if value == 0 or sd == 0:
        return AT_BOUND.format(value)
    if not np.isfinite(sd):
        return NOT_TOLD
    relative = sd / abs(value)
    return "" if relative <= DETERMINED.max_relative_sd else UNCERTAIN.format(relative)


def with_reasons(found: Estimate, judged: Iterable[int]) -> Estimate:
    """The estimate with reasons for the unidentified ones among the `judged` figures."""
    deviations, reasons = np.sqrt(np.diag(found.covariance)), [*found.reasons]
    for k in judged:
        reasons[k] = reasons[k] or reason_of(float(found.value[k]), float(deviations[k]))
    return replace(found, reasons=tuple(reasons))


@dataclass(frozen=True, eq=False)
class Unbounded:
    """Solution with p unknowns, each without its own bound."""

    value: Array
    """Values (p,): the own bound of an unknown is lifted, and all other bounds hold."""
    replicates: Array
    """Values (G, p) without one group each, around the bounded values."""
    undetermined: Mask
    """Unknowns (p,) that the logs without some group do not determine."""

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
    """Solve again for each unknown at its bound, with this bound lifted.

    Args:
        grouped: normal equations of the G groups.
        value: bounded solution (p,).
        inside: estimated unknowns (p,) away from their bounds.
        bounded: estimated unknowns (p,) at their bounds; the remaining unknowns are known.
        gradient: gradient (p,) of the sum of squares at the solution.
        prior: precision (p, p) of a prior.
    """
    lifted, (replicates, undetermined) = value.copy(), leave_one_out(grouped, value, inside, prior)
    total = grouped.gram.sum(axis=0) + (0.0 if prior is None else prior)
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
    """Terms (p,) whose values (p,) no drive has: too small a factor on its torque, or a load
    friction under which it does not move."""
    term = np.array([name[0] for name in names])
    too_small = (term == SCALE) & (value < DETERMINED.least_scale)
    return np.asarray(too_small | ((term == "load") & (value > DETERMINED.most_load)))


def rejections(value: Array, sd: Array, own: Array) -> Array:
    """Distances (p,) of the robot's own values (p,) from estimates, in standard deviations; 0 where
    the logs do not reject them."""
    distance = np.abs(own - value) / np.where(sd > 0, sd, np.inf)
    return np.where(distance > DETERMINED.rejecting_sds, distance, 0.0)


def remarks_of(
    reasons: Sequence[str], value: Array, sd: Array, own: Array, own_sd: Array
) -> list[str]:
    """Why the robot's own values of doubted terms are not kept; empty for all other terms.

    Args:
        reasons: reasons (p,) for a doubt, or empty.
        value: estimates (p,) without bounds; those beyond a bound, 0, are no source.
        sd: standard deviations (p,) of the estimates; infinite for estimates that replace nothing.
        own: the robot's own values (p,).
        own_sd: their standard deviations (p,); 0 for values that are kept unless they are rejected.
    """
    rejected = rejections(value, sd, own)
    better = (value > 0) & (sd <= DETERMINED.max_sd_ratio * own_sd) & (own_sd > 0)
    remarks = [""] * len(reasons)
    for k, reason in enumerate(reasons):
        if reason and rejected[k]:
            remarks[k] = REJECTED.format(reason, own[k], rejected[k])
        elif reason and better[k]:
            remarks[k] = LESS_KNOWN.format(reason, own[k], own_sd[k])
    return remarks
