"""Payloads of one density, whose moments are also Pinocchio's and those of their hull."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Attachment, Box, Capsule, Cylinder, Mesh, Payload, Sphere, even_payload
from joulepath.models.robot import Array
from joulepath.optimizer.problem.scene import Shape

MASS = 2.5
ROUNDING = 1e-12  # relative, of sums of a few hundred products
SIZE = np.array([0.06, 0.1, 0.2])
CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T / 2 * SIZE
PLACE = pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.7, 1.1), np.array([0.02, -0.03, 0.12]))


def body(payload: Payload) -> pin.Inertia:
    return pin.Inertia(payload.mass, payload.com, payload.inertia)


def check(payload: Payload, expected: pin.Inertia) -> None:
    assert payload.mass == pytest.approx(expected.mass, rel=ROUNDING)
    np.testing.assert_allclose(payload.com, expected.lever, atol=ROUNDING)
    np.testing.assert_allclose(payload.inertia, expected.inertia, atol=ROUNDING)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (Box(SIZE), pin.Inertia.FromBox(MASS, *SIZE)),
        (Sphere(0.05), pin.Inertia.FromSphere(MASS, 0.05)),
        (Cylinder(0.04, 0.15), pin.Inertia.FromCylinder(MASS, 0.04, 0.15)),
        (Capsule(0.04, 0.15), pin.Inertia.FromCapsule(MASS, 0.04, 0.15)),
        (Mesh(CORNERS), pin.Inertia.FromBox(MASS, *SIZE)),
    ],
    ids=lambda each: type(each).__name__,
)
def test_centre_and_inertia_are_those_of_the_shape_at_its_pose(
    shape: Shape, expected: pin.Inertia
) -> None:
    check(even_payload(MASS, Attachment(shape, PLACE.homogeneous)), PLACE.act(expected))


def test_a_hull_may_lie_anywhere_about_its_origin() -> None:
    """Two parts of a box, each about its own middle, make the box."""
    cut = np.array([0.0, 0.0, SIZE[2] / 2])
    parts = (SIZE * [1, 1, 0.75], SIZE * [1, 1, 0.25])
    middles = (-cut + [0, 0, parts[0][2] / 2], cut - [0, 0, parts[1][2] / 2])

    def part(share: float, size: Array, middle: Array) -> pin.Inertia:
        hull = Mesh(CORNERS / SIZE * size + middle)
        return body(even_payload(share * MASS, Attachment(hull)))

    (long, short), shares = zip(parts, middles, strict=True), (0.75, 0.25)
    whole = part(shares[0], *long) + part(shares[1], *short)
    check(even_payload(MASS, Attachment(Box(SIZE))), whole)
