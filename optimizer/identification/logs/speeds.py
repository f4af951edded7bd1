"""Whether logged speeds are those of the logged positions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.robot import Array
from optimizer.exceptions import InvalidTable
from optimizer.identification.logs.filters import derivative, low_passed

_MISFIT = 0.2
"""Greatest deviation of logged speeds from the change of the positions, over the speeds, as standard deviations."""
_LEAST_SPEED = 0.01  # rad/s, standard deviation from which on speeds are compared
_MOST_FACTOR = 1.5  # by which all speeds may be larger or smaller than the positions say
_LEAST_LIKE = 0.8  # correlation of speeds that are the right ones, but for their unit or sign


def misfitting(q: Array, v: Array, rate: float, names: Sequence[str]) -> list[int]:
    """The joints whose speeds v (n, joints) [rad/s], from columns `names`, are not the change of q (n, joints) [rad].

    Raises InvalidTable if all of them are off by one factor, as in another unit or with the other sign.
    """
    wrong, factors, moved = list[int](), list[float](), list[int]()
    for joint in range(q.shape[1]):
        smooth, change = low_passed(v[:, [joint]], rate)[:, 0], derivative(q[:, [joint]], rate)[:, 0]
        size, real = float(smooth.std()), float(change.std())
        if size > _LEAST_SPEED and float((smooth - change).std()) > _MISFIT * size:
            wrong.append(joint)
        if real > _LEAST_SPEED:
            moved.append(joint)
            alike = abs(float(((smooth - smooth.mean()) * (change - change.mean())).mean())) > _LEAST_LIKE * size * real
            if alike or size == 0:
                factors.append(float((smooth * change).mean() / (change**2).mean()))
    if moved and len(factors) == len(moved):
        _check_factor(float(np.median(factors)), names[moved[0]])
    return wrong


def _check_factor(factor: float, name: str) -> None:
    if 1 / _MOST_FACTOR < factor < _MOST_FACTOR:
        return
    what = f"{factor:.3g} times the change of the positions"
    if factor == 0:
        what = "0, while the positions change"
    raise InvalidTable(
        f"The speeds, as {name}, are {what}: give both in one unit (rad and rad/s, or degrees with units=deg) and with "
        "one sign, or leave the columns of speeds and accelerations out, and they are made from the positions.",
        None,
        name,
    )
