"""Consistency of logged speeds with positions, and of logged accelerations with speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.columns import Columns
from joulepath.optimizer.identify.logs.filters import derivative, filtered, low_passed, noise
from joulepath.optimizer.identify.logs.log_warnings import named_joints


@dataclass(frozen=True)
class SpeedSettings:
    """Tolerances between logged derivatives and derivatives of logged channels."""

    max_speed_error: float = 0.2
    """Standard deviation of the error of logged speeds over that of the speeds, above which they
    are replaced [1]."""
    min_speed: float = 0.01
    """Standard deviation of speeds, below which they are not compared [rad/s]."""
    max_factor: float = 1.5
    """Common factor between all logged speeds and the derivatives of the positions, from which on
    the log is refused [1]."""
    max_clock: float = 5.0
    """Common factor up to which the clock may be wrong; units differ by more [1]."""
    clock_tolerance: float = 0.05
    """Difference of the factors of all joints, up to which the clock is the cause, and of a clock
    from that of the controller [1]."""
    min_correlation: float = 0.8
    """Correlation of speeds that are right up to a factor [1]."""
    acceleration_cutoff: float = 5.0
    """Cut-off frequency of compared accelerations [Hz]; above it, derivatives of noisy speeds are
    noise."""
    min_acceleration: float = 0.05
    """Standard deviation of accelerations, below which they are not compared [rad/s²]."""
    noise_ratio: float = 4.0
    """Standard deviation of accelerations over their noise, below which they are not compared
    [1]."""
    max_acceleration_error: float = 0.5
    """Standard deviation of the error of logged accelerations over that of the accelerations, above
    which they are replaced [1]."""


SPEEDS = SpeedSettings()


def speeds_of(
    q: Array, v: Array | None, a: Array | None, columns: Columns, rate: float, remarks: list[str]
) -> tuple[Array, Array]:
    """Speeds and accelerations, derived where they were not logged or are inconsistent.

    Args:
        q: positions (n, joints) [rad].
        v: logged speeds (n, joints) [rad/s], or None.
        a: logged accelerations (n, joints) [rad/s²], or None.
        columns: columns of the file.
        rate: rate of the rows [Hz].
        remarks: list to receive a warning of inconsistent channels.

    Raises:
        InvalidTable: all speeds are wrong by a common factor.
    """
    wrong: list[int] = []
    if v is None:
        v = derivative(q, rate)
    elif wrong := _inconsistent_speeds(q, v, rate, columns, remarks):
        v = _replaced(v, derivative(q[:, wrong], rate), wrong)
        remarks.append(
            f"The speeds of {named_joints(wrong)} do not fit the positions, and are computed "
            "from them: check units, signs and the order of the columns."
        )
    if a is None:
        return v, derivative(v, rate)
    odd = _inconsistent_accelerations(v, a, rate)
    if set(odd) - set(wrong):
        remarks.append(
            f"The accelerations of {named_joints(odd)} do not fit the speeds, and are computed "
            "from them: check units, signs and the order of the columns, or leave them out."
        )
    odd = sorted({*odd, *wrong})
    return v, _replaced(a, derivative(v[:, odd], rate), odd) if odd else a


def _replaced(values: Array, by: Array, joints: list[int]) -> Array:
    """Channels (n, joints) with some joints replaced by other channels (n, len(joints))."""
    values = values.copy()
    values[:, joints] = by
    return values


def _inconsistent_speeds(
    q: Array, v: Array, rate: float, columns: Columns, remarks: list[str]
) -> list[int]:
    """Joints with speeds (n, joints) [rad/s] that are not the derivatives of positions (n, joints).

    Speeds that are wrong by a common factor near 1 are right, and the clock is wrong.

    Raises:
        InvalidTable: all speeds are wrong by a common factor, as in another unit or of opposite
            sign, or a joint has speeds without a change of its position.
    """
    wrong, factors, moved = list[int](), list[float](), list[int]()
    for joint in range(q.shape[1]):
        logged = low_passed(v[:, [joint]], rate)[:, 0]
        derived = derivative(q[:, [joint]], rate)[:, 0]
        size, real = float(logged.std()), float(derived.std())
        if np.ptp(q[:, joint]) == 0 and size > SPEEDS.min_speed:
            name, speed = (columns.names[columns.groups[each][joint]] for each in ("q", "v"))
            raise InvalidTable(
                f"{name} never changes, although the joint moves according to its speeds in "
                f"{speed}: log its position, or set its speeds to 0 if the joint was at rest.",
                None,
                name,
            )
        largest, error = max(size, real), float((logged - derived).std())
        if largest > SPEEDS.min_speed and error > SPEEDS.max_speed_error * largest:
            wrong.append(joint)
        if real > SPEEDS.min_speed:
            moved.append(joint)
            product = (logged - logged.mean()) * (derived - derived.mean())
            correlated = abs(float(product.mean())) > SPEEDS.min_correlation * size * real
            if correlated or size == 0:
                factors.append(float((logged * derived).mean() / (derived**2).mean()))
    if moved and len(factors) == len(moved):
        factor, clock = float(np.median(factors)), columns.names[columns.time[0]]
        alike = np.ptp(factors) < SPEEDS.clock_tolerance * factor and len(moved) > 1
        _check_factor(factor, columns.names[columns.groups["v"][moved[0]]], clock if alike else "")
        if alike and abs(factor - 1) > SPEEDS.clock_tolerance:
            remarks.append(
                f"The speeds are {factor:.3g} times the change of the positions, in all joints "
                f"alike: the clock {clock} is nominal, and not that of the controller. The speeds "
                "are taken as they are, and durations and energies are wrong by this factor: log "
                "the time of the controller."
            )
            return []
    return wrong


def _check_factor(factor: float, name: str, clock: str) -> None:
    """Check the factor between logged speeds and derivatives of the positions.

    Args:
        factor: the factor.
        name: name of a column of speeds.
        clock: name of the column of times, if it may be wrong by this factor.
    """
    if 1 / SPEEDS.max_factor < factor < SPEEDS.max_factor:
        return
    if clock and 1 / SPEEDS.max_clock < factor < SPEEDS.max_clock:
        raise InvalidTable(
            f"The speeds are {factor:.3g} times the change of the positions, in all joints alike: "
            f"the clock {clock} is nominal, and not that of the controller. Log the time of the "
            f"controller, or divide the times by {factor:.3g}; leave the columns of speeds out "
            "only if the clock is right.",
            None,
            clock,
        )
    relation = f"{factor:.3g} times the change of the positions"
    if factor == 0:
        relation = "0, while the positions change"
    raise InvalidTable(
        f"The speeds, such as {name}, are {relation}: give both in one unit (rad and rad/s, or "
        "degrees with units=deg) and with one sign, or leave the columns of speeds and "
        "accelerations out, to compute them from the positions.",
        None,
        name,
    )


def _inconsistent_accelerations(v: Array, a: Array, rate: float) -> list[int]:
    """Joints with accelerations (n, joints) [rad/s²] that are not the derivatives of speeds."""
    cutoff, wrong = min(SPEEDS.acceleration_cutoff, rate / 5), list[int]()
    for joint in range(v.shape[1]):
        speed = filtered(v[:, joint], rate, cutoff)
        derived = np.gradient(speed, 1 / rate)
        by_noise = (
            2 * np.pi * cutoff * np.sqrt(cutoff / rate) * float(noise(v[:, [joint]], rate)[0])
        )
        size = float(derived.std())
        if size > max(SPEEDS.min_acceleration, SPEEDS.noise_ratio * by_noise):
            error = filtered(a[:, joint], rate, cutoff) - derived
            if float(error.std()) > SPEEDS.max_acceleration_error * size:
                wrong.append(joint)
    return wrong
