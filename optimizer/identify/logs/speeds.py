"""Whether logged speeds are those of the logged positions, and logged accelerations those of the
speeds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.columns import Columns
from joulepath.optimizer.identify.logs.filters import derivative, filtered, low_passed, noise
from joulepath.optimizer.identify.logs.log_warnings import numbers_of_joints

_MISFIT = 0.2
"""Greatest deviation of logged speeds from the change of the positions, over the speeds, as
standard deviations.
"""
_LEAST_SPEED = 0.01  # rad/s, standard deviation from which on speeds are compared
_MOST_FACTOR = 1.5  # by which all speeds may be larger or smaller than the positions say
_LEAST_LIKE = 0.8  # correlation of speeds that are the right ones, but for their unit or sign
_SLOW = 5.0  # Hz, of accelerations that are compared: faster ones of noisy speeds are noise
_LEAST_ACCELERATION = 0.05  # rad/s², standard deviation from which on they are compared
_MOST_MISFIT, _OF_NOISE = 0.5, 4.0  # of their deviation, and of what the noise of the speeds makes


def speeds_of(
    q: Array, v: Array | None, a: Array | None, columns: Columns, rate: float, remarks: list[str]
) -> tuple[Array, Array]:
    """Speeds and accelerations, made from positions q (n, joints) where they were not logged, or
    are not theirs.

    What is not theirs goes to `remarks`. Raises InvalidTable if all speeds are off by one factor.
    """
    wrong: list[int] = []
    if v is None:
        v = derivative(q, rate)
    elif wrong := _misfitting(q, v, rate, [columns.names[k] for k in columns.groups["v"]]):
        v = _replaced(v, derivative(q[:, wrong], rate), wrong)
        remarks.append(
            f"The speeds of joints {numbers_of_joints(wrong)} do not fit their positions, and are "
            "made from these: "
            "check units, signs and the order of the columns."
        )
    if a is None:
        return v, derivative(v, rate)
    odd = _misfitting_accelerations(v, a, rate)
    if set(odd) - set(wrong):
        remarks.append(
            f"The accelerations of joints {numbers_of_joints(odd)} are not the change of their "
            "speeds, and are made "
            "from these: check units, signs and the order of the columns, or leave them out."
        )
    odd = sorted({*odd, *wrong})
    return v, _replaced(a, derivative(v[:, odd], rate), odd) if odd else a


def _replaced(values: Array, by: Array, joints: list[int]) -> Array:
    """The channels (n, joints) with those of some joints replaced `by` others (n, len(joints))."""
    values = values.copy()
    values[:, joints] = by
    return values


def _misfitting(q: Array, v: Array, rate: float, names: Sequence[str]) -> list[int]:
    """The joints whose speeds v (n, joints) [rad/s], from columns `names`, are not the change of q
    (n, joints) [rad].

    Raises InvalidTable if all of them are off by one factor, as in another unit or with the other
    sign.
    """
    wrong, factors, moved = list[int](), list[float](), list[int]()
    for joint in range(q.shape[1]):
        smooth, change = (
            low_passed(v[:, [joint]], rate)[:, 0],
            derivative(q[:, [joint]], rate)[:, 0],
        )
        size, real = float(smooth.std()), float(change.std())
        if max(size, real) > _LEAST_SPEED and float((smooth - change).std()) > _MISFIT * max(
            size, real
        ):
            wrong.append(joint)
        if real > _LEAST_SPEED:
            moved.append(joint)
            alike = (
                abs(float(((smooth - smooth.mean()) * (change - change.mean())).mean()))
                > _LEAST_LIKE * size * real
            )
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
        f"The speeds, as {name}, are {what}: give both in one unit (rad and rad/s, or degrees with "
        "units=deg) and with "
        "one sign, or leave the columns of speeds and accelerations out, and they are made from "
        "the positions.",
        None,
        name,
    )


def _misfitting_accelerations(v: Array, a: Array, rate: float) -> list[int]:
    """The joints whose accelerations a (n, joints) [rad/s²] are not the change of v (n, joints)
    [rad/s].
    """
    highest, wrong = min(_SLOW, rate / 5), list[int]()
    for joint in range(v.shape[1]):
        speed = filtered(v[:, joint], rate, highest)
        change = np.gradient(speed, 1 / rate)
        by_noise = (
            2 * np.pi * highest * np.sqrt(highest / rate) * float(noise(v[:, [joint]], rate)[0])
        )
        size = float(change.std())
        if size > max(_LEAST_ACCELERATION, _OF_NOISE * by_noise):
            error = filtered(a[:, joint], rate, highest) - change
            if float(error.std()) > _MOST_MISFIT * size:
                wrong.append(joint)
    return wrong
