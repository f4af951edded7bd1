"""What the links' inertials are made of, what logs tell of them, and whether they are real."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import BODY, body_parameters
from joulepath.optimizer.identify.arm.base_parameters import base_parameters
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.pseudo_inertia import pseudo_inertias
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import Physical, Structure
from joulepath.optimizer.identify.rows.fit_rows import Rows

# of the largest singular value of the scaled columns: below it, a combination of base parameters is
# not excited
LEAST_EXCITED = 1e-3
# of the largest entry: rounding of a solver's least eigenvalue
ROUNDED = 1e-8


def structure_of(robot: Robot, rows: Rows, options: IdentificationOptions) -> Structure:
    """Standard and base parameters of bodies and, if they are fitted, rotors; what the rows tell of
    the bodies'.
    """
    rotors = "rotor" in options.fit
    base = base_parameters(robot.model, rotors)
    condition, excited = None, None
    if rows.regressor is not None:
        gram = np.zeros((base.count, base.count))
        for joint, axis in enumerate(np.eye(robot.nq)):
            columns = rows.regressor[~rows.rest, joint]
            if rotors:
                columns = np.hstack([columns, np.outer(rows.a[~rows.rest, joint], axis)])
            chosen = columns[:, base.independent]
            gram += chosen.T @ chosen
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        values = np.sqrt(np.maximum(np.linalg.eigvalsh(gram / np.outer(scale, scale)), 0.0))
        excited = int((values > LEAST_EXCITED * values[-1]).sum())
        condition = float(values[-1] / values[0]) if values[0] > 0 else np.inf
    return Structure((BODY + rotors) * robot.nq, base.count, base.expressions, condition, excited)


def physical_of(robot: Robot, arm: FittedArm) -> Physical | None:
    """Whether fitted links are real bodies; None where the robot's own are kept."""
    if arm.bodies is None:
        return None
    matrices = pseudo_inertias(body_parameters(robot.model) + arm.bodies)
    least = np.linalg.eigvalsh(matrices)[:, 0]
    return Physical(
        bool((least >= -ROUNDED * np.abs(matrices).max(axis=(1, 2))).all()), np.asarray(least)
    )


def inertials_of(robot: Robot, change: Array) -> dict[str, Array]:
    """Figures of links whose parameters are changed by (10 nq,): mass (nq,) [kg], center_of_mass
    (nq, 3) [m], and inertia (nq, 6) [kg·m²] about it as ixx, ixy, ixz, iyy, iyz, izz; all in the
    link frames."""
    parameters = (body_parameters(robot.model) + change).reshape(-1, BODY)
    bodies = [pin.Inertia.FromDynamicParameters(each) for each in parameters]
    rows, columns = (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)
    return {
        "mass": np.array([body.mass for body in bodies]),
        "center_of_mass": np.array([body.lever for body in bodies]),
        "inertia": np.array([body.inertia[rows, columns] for body in bodies]),
    }
