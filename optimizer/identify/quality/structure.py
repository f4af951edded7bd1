"""Base parameters of the links, their excitation by logs, and their physical consistency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters
from joulepath.optimizer.identify.arm.base_parameters import base_parameters
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.pseudo_inertia import pseudo_inertias
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import Physical, Structure
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class StructureSettings:
    """Tolerances of excitation and physical consistency."""

    min_excitation: float = 1e-3
    """Singular value of the columns of unit length over the largest one, up to which a combination
    of base parameters is not excited [1]."""
    eigenvalue_tolerance: float = 1e-8
    """Negative eigenvalue of a pseudo-inertia over its largest entry, up to which it is a rounding
    error of the solver [1]."""


STRUCTURE = StructureSettings()


def structure_of(robot: Robot, rows: Rows, options: IdentificationOptions) -> Structure:
    """Parameters of bodies and fitted rotors, and their excitation by the rows."""
    rotors = "rotor" in options.fit and not rows.link_side
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
        excited = int((values > STRUCTURE.min_excitation * values[-1]).sum())
        condition = float(values[-1] / values[0]) if values[0] > 0 else np.inf
    return Structure(
        (PARAMETERS_PER_BODY + rotors) * robot.nq, base.count, base.expressions, condition, excited
    )


def physical_of(robot: Robot, arm: FittedArm) -> Physical | None:
    """Physical consistency of fitted links; None where the robot's own are kept."""
    if arm.link_change is None:
        return None
    matrices = pseudo_inertias(body_parameters(robot.model) + arm.link_change)
    least = np.linalg.eigvalsh(matrices)[:, 0]
    tolerance = STRUCTURE.eigenvalue_tolerance * np.abs(matrices).max(axis=(1, 2))
    return Physical(bool((least >= -tolerance).all()), np.asarray(least))


def inertials_of(robot: Robot, change: Array) -> dict[str, Array]:
    """Inertials of links with changed parameters.

    Args:
        robot: the robot with its own links.
        change: change (10 nq,) of the links' parameters.

    Returns:
        `mass` (nq,) [kg], `center_of_mass` (nq, 3) [m], and `inertia` (nq, 6) [kg·m²] about it as
        ixx, ixy, ixz, iyy, iyz, izz; all in the link frames.
    """
    parameters = (body_parameters(robot.model) + change).reshape(-1, PARAMETERS_PER_BODY)
    bodies = [pin.Inertia.FromDynamicParameters(each) for each in parameters]
    rows, columns = (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)
    return {
        "mass": np.array([body.mass for body in bodies]),
        "center_of_mass": np.array([body.lever for body in bodies]),
        "inertia": np.array([body.inertia[rows, columns] for body in bodies]),
    }
