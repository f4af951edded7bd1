"""Torque errors on held-out motions, relative to the errors of an outsider's ordinary least
squares.

The outsider knows the geometry of the arm, but neither its bodies nor its drives. It fits base
parameters and the friction of all joints by the pseudo-inverse, in two variants: with Coulomb
friction, viscous friction and an offset, and additionally with friction that grows with the load.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.gate import Gate
from benchmarks.public_logs import panda_by_inria, panda_by_unisa, ur10e_split
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.arm.fitted_arm import own_arm
from joulepath.optimizer.identify.fits.by_method import prepare
from joulepath.optimizer.identify.fits.fitting import fit_rows
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.rows.fit_rows import Rows, rows_of
from joulepath.optimizer.problem.robots import load_robot

MOVING = 0.02
"""Smallest speed of a joint at which its errors count [rad/s]."""
LEAST_SINGULAR = 1e-6
"""Share of the largest singular value below which a combination of parameters is undetermined."""
UR10E = 1.03
"""Largest admissible ratio of our error to the outsider's error for a joint of the UR10e [1]."""
PANDA = 1.0
"""Largest admissible ratio for a joint of the Pandas [1]."""


def outsider(place: Path | None, _: int) -> list[Gate]:
    """Gates of the RMSE of every joint over the smaller RMSE of the outsider's two fits."""
    assert place is not None
    robot, fitted, other = ur10e_split(place)
    every = rows_of(robot, [fitted, other], regressor=True)
    found = _ratios(robot, [fitted], [(every.take(every.log == 0), every.take(every.log == 1))])
    gates = _gates("UR10e, authors' split", found, UR10E)
    robot = load_robot("panda")
    for name, log in (("Inria", panda_by_inria(place)), ("Unisa", panda_by_unisa(place))):
        rows = rows_of(robot, [log], regressor=True)
        first = np.arange(len(rows.q)) < len(rows.q) // 2
        halves = rows.take(first), rows.take(~first)
        found = _ratios(robot, [log], [halves, halves[::-1]])
        gates += _gates(f"Panda of {name}, each half from the other", found, PANDA)
    return gates


def _gates(title: str, ratios: Array, most: float) -> list[Gate]:
    return [
        Gate(f"{title}: error of J{joint} over an outsider's", ratio, 0.0, most)
        for joint, ratio in enumerate(ratios.tolist(), 1)
    ]


def _ratios(robot: Robot, logs: Sequence[Log], parts: Sequence[tuple[Rows, Rows]]) -> Array:
    """RMSE (nq,) over the smaller RMSE of the outsider, summed over the parts.

    A part has the rows of the fit, and the rows of the prediction.
    """
    _, options = prepare(robot, logs, IdentificationOptions(held_out=0.0))
    squares, own = list[list[Array]](), own_arm(robot)
    for seen, rest in parts:
        arm, torque = fit_rows(robot, seen, options).arm, own.logged_torque(rest)
        # in the outsider's unit: currents times the robot's own torque constants
        ours = arm.measured_torque(rest) * own.torque_constant / arm.torque_constant
        predicted = [ours, *_outsiders(seen, own.logged_torque(seen), rest)]
        moving = np.abs(rest.v) > MOVING
        squares.append([(moving * (each - torque) ** 2).sum(axis=0) for each in predicted])
    ours, *others = np.sum(squares, axis=0)
    return np.asarray(np.sqrt(ours / np.min(others, axis=0)))


def _outsiders(seen: Rows, torque: Array, rest: Rows) -> list[Array]:
    """Torques (n, nq) [N·m] of the rest by fits to the seen rows, without and with friction that
    grows with the load."""
    found, load = list[Array](), [np.zeros_like(each.v) for each in (seen, rest)]
    while len(found) < 2:
        left, right = (_columns(*each) for each in zip((seen, rest), load, strict=True))
        use = (np.abs(seen.v) > MOVING).ravel()
        scale = np.ones(torque.shape[1])
        for _ in range(2):
            weight = np.tile(1 / scale, len(torque))
            parameters = np.linalg.lstsq(
                (left * weight[:, None])[use], (torque.ravel() * weight)[use], LEAST_SINGULAR
            )[0]
            error = torque - (left @ parameters).reshape(torque.shape)
            scale = np.sqrt(np.mean(error**2, axis=0))
        found.append((right @ parameters).reshape(rest.v.shape))
        bodies = parameters[: -4 * torque.shape[1]]
        load = [np.abs(_bodies(each) @ bodies) for each in (seen, rest)]
    return found


def _columns(rows: Rows, load: Array) -> Array:
    """Columns (n nq, parameters) of the bodies, and of the friction of all joints."""
    sign, joints = np.sign(rows.v), np.eye(rows.v.shape[1])
    terms = [sign, rows.v, np.ones_like(sign), load * sign]
    friction = [each[:, :, None] * joints for each in terms]
    columns = np.concatenate([_bodies(rows), *friction], axis=2)
    return columns.reshape(-1, columns.shape[2])


def _bodies(rows: Rows) -> Array:
    """Columns (n, nq, 10 nq) of the bodies."""
    assert rows.regressor is not None
    return rows.regressor
