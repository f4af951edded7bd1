"""Principal axes of a payload, in which controllers expect its inertia."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arm import Payload


def principal_axes(load: Payload) -> tuple[Array, Rotation]:
    """Principal moments (3,) [kg·m²] about the centre of mass, and the rotation from the principal
    axes to the flange frame; the axes are those of the flange if the inertia is diagonal in it.
    """
    moments, axes = np.diag(load.inertia), np.eye(3)
    if not np.array_equal(load.inertia, np.diag(moments)):
        moments, axes = np.linalg.eigh(load.inertia)
        axes[:, 0] *= np.linalg.det(axes)
    # rounding makes a moment of zero negative, which controllers refuse
    return np.maximum(moments, 0.0), Rotation.from_matrix(axes)
