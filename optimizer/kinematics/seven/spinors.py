"""Rotations as spinors.

The spinor of a rotation is the first column (2,) of its unitary matrix U (2, 2), where a turn by q
about z is diag(e^{-iq/2}, e^{iq/2}). A product of rotations costs half as much as with rotation
matrices, and the Euler angles are the arguments of two complex numbers.

The rotation R_z(φ) R_y(χ) R_z(ψ), with χ from 0 to π, has the spinor (cos(χ/2) e^{-i(φ + ψ)/2},
sin(χ/2) e^{i(φ - ψ)/2}). So φ and ψ follow from the sum and the difference of its arguments (H.
Goldstein, "Classical Mechanics", 1980, section 4-5).
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array

Complex = NDArray[np.complex128]


def unitary(R: Array) -> Complex:
    """Unitary matrix U (2, 2) of a rotation R (3, 3), up to its sign."""
    (a, b, c), (d, e, f), (g, h, k) = R.tolist()
    # The largest component of the quaternion divides the others (S. Shepperd, 1978).
    w, x, y, z = 1 + a + e + k, 1 + a - e - k, 1 - a + e - k, 1 - a - e + k
    most = max(w, x, y, z)
    if most == w:
        x, y, z = h - f, c - g, d - b
    elif most == x:
        w, y, z = h - f, b + d, c + g
    elif most == y:
        w, x, z = c - g, b + d, f + h
    else:
        w, x, y = d - b, c + g, f + h
    scale = 1 / (2 * sqrt(most))
    w, x, y, z = w * scale, x * scale, y * scale, z * scale
    return np.array([[complex(w, -z), complex(-y, -x)], [complex(y, -x), complex(w, z)]])
