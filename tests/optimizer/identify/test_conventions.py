"""One arm and one log, drawn in different conventions: the figures predict the same energies.

The URDF of an arm is mirrored, its base is turned, its joints turn the other way, have other zeros
and other frames of their links, and its log has the joints in another order. The torques come from
Pinocchio's recursion on the URDF.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    Identification,
    IdentificationOptions,
    Log,
    LogOptions,
    Payload,
    Robot,
    Validation,
    identify,
    read_log,
)
from joulepath.models.own_arm.description import Description, Drives, Electronics
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.robot import Array
from tests.by_pinocchio import torques_of
from tests.identification_logs import GRAVITY, WITHOUT_SPLIT, Recording, recorded, truth_of
from tests.selection import long_but

# of energies and torques: steps of the fit of the power end at 1e-9, and cells have 12 digits
SAME = 1e-7
# the same with refitted links, whose interior-point method ends near the solution
SAME_OF_LINKS = 1e-5
# of the widths of intervals, the differences of nearly equal fits
SAME_WIDTH = 1e-5
# the same with refitted links: errors of less than a thousandth of the variance of the largest one
# are left out, and the parameters of a link, and so their errors, depend on its frame
SAME_WIDTH_OF_LINKS = 2e-3


@dataclass(frozen=True)
class Link:
    """A link in the frame of its joint, and the place of this frame in that of the link before."""

    R: Array
    p: Array
    axis: Array
    mass: float
    com: Array
    inertia: Array
    """About the centre of mass, in the axes of the frame [kg·m²]."""
    torque: float
    sign: float = 1.0
    zero: float = 0.0
    """Position q of the drawn arm is sign · q of the arm - zero."""


Arm = tuple[tuple[Link, ...], Array]
"""Links, and gravity in the base frame [m/s²]."""


def drawn(nq: int) -> Arm:
    random, links = np.random.default_rng(nq), []
    for k in range(nq):
        second = random.normal(size=(3, 3)) * 0.05
        spread = 8 * 0.6**k * (0.3 * second @ second.T + 0.002 * np.eye(3))
        tilt = Rotation.from_euler("x", np.pi / 2 * (-1) ** k if k else 0.1)
        place = random.uniform(-0.1, 0.3, 3) if k < 4 else np.full(3, 0.02)
        com, z = random.normal(size=3) * 0.05 + 0.05, np.array([0.0, 0.0, 1.0])
        inertia = np.trace(spread) * np.eye(3) - spread
        links.append(Link(tilt.as_matrix(), place, z, 8 * 0.6**k, com, inertia, 250 * 0.5**k + 12))
    return tuple(links), GRAVITY


def mirrored(arm: Arm) -> Arm:
    M, (links, gravity) = np.diag([1.0, -1.0, 1.0]), arm
    # an axis of rotation is a pseudovector
    return tuple(
        replace(
            each,
            R=M @ each.R @ M,
            p=M @ each.p,
            axis=-M @ each.axis,
            com=M @ each.com,
            inertia=M @ each.inertia @ M,
        )
        for each in links
    ), M @ gravity


def turned(arm: Arm) -> Arm:
    B = Rotation.from_euler("xyz", [0.7, -0.4, 1.1]).as_matrix()
    (first, *others), gravity = arm
    return (replace(first, R=B @ first.R, p=B @ first.p), *others), B @ gravity


def reversed_joints(arm: Arm) -> Arm:
    return tuple(
        replace(each, axis=-each.axis, sign=-each.sign) if k % 2 else each
        for k, each in enumerate(arm[0])
    ), arm[1]


def other_zeros(arm: Arm) -> Arm:
    def moved(each: Link, zero: float) -> Link:
        return replace(
            each, R=each.R @ Rotation.from_rotvec(zero * each.axis).as_matrix(), zero=zero
        )

    return tuple(moved(each, 0.4 - 0.2 * k) for k, each in enumerate(arm[0])), arm[1]


def other_frames(arm: Arm) -> Arm:
    """The frame of every link is turned, and moved along the axis of its joint."""
    random, links, before = np.random.default_rng(5), list[Link](), pin.SE3.Identity()
    for each in arm[0]:
        new = pin.SE3(pin.exp3(random.normal(size=3)), 0.1 * random.normal() * each.axis)
        joint = before.inverse() * pin.SE3(each.R, each.p) * new
        body = new.inverse().act(pin.Inertia(each.mass, each.com, each.inertia))
        axis = new.rotation.T @ each.axis
        links.append(
            replace(
                each,
                R=joint.rotation,
                p=joint.translation,
                axis=axis,
                com=body.lever,
                inertia=body.inertia,
            )
        )
        before = new
    return tuple(links), arm[1]


Drawing = Callable[[Arm], Arm]
EVERY: tuple[Drawing, ...] = (other_frames, reversed_joints, other_zeros, mirrored, turned)


def urdf_of(arm: Arm) -> str:
    def text(values: Array) -> str:
        return " ".join(f"{each:.17g}" for each in values)

    parts = ['<robot name="arm"><link name="link0"/>']
    for k, each in enumerate(arm[0], 1):
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = each.inertia.tolist()
        low, high = sorted((each.sign * np.array([-2.6, 2.6]) - each.zero).tolist())
        parts.append(
            f'<link name="link{k}"><inertial><origin xyz="{text(each.com)}"/>'
            f'<mass value="{each.mass}"/><inertia ixx="{xx}" ixy="{xy}" ixz="{xz}" iyy="{yy}" '
            f'iyz="{yz}" izz="{zz}"/></inertial></link><joint name="axis_{k}" type="revolute">'
            f'<parent link="link{k - 1}"/><child link="link{k}"/>'
            f'<origin xyz="{text(each.p)}" rpy="{text(pin.rpy.matrixToRpy(each.R))}"/>'
            f'<axis xyz="{text(each.axis)}"/>'
            f'<limit lower="{low}" upper="{high}" velocity="2.5" effort="{each.torque}"/></joint>'
        )
    return "".join([*parts, "</robot>"])


def robot_of(arm: Arm) -> Robot:
    torque = tuple(each.torque for each in arm[0])
    drives = Drives(*(tuple(share * each for each in torque) for share in (0.012, 0.05, 0.05)))
    figures, _ = own_figures(
        "arm",
        Description(
            urdf=urdf_of(arm),
            tip=f"link{len(torque)}",
            payload=3.0,
            acceleration=10.0,
            drives=drives,
            electronics=Electronics(idle_power=33.0),
        ),
    )
    return own_robot("arm", figures)


def log_of(recording: Recording, arm: Arm, shuffled: bool = False) -> tuple[Robot, Log]:
    """The log of an arm, as its drawing describes it, perhaps with its joints in another order."""
    robot, nq = robot_of(arm), recording.robot.nq
    sign, zero = (np.array([getattr(each, name) for each in arm[0]]) for name in ("sign", "zero"))
    parts = {
        "position": sign * recording.q - zero,
        "velocity": sign * recording.v,
        "current": sign * recording.current,
    }
    order = np.random.default_rng(1).permutation(nq) if shuffled else np.arange(nq)
    header = ["time", *(f"axis_{k + 1}/{name}" for name in parts for k in order)]
    table = np.column_stack([recording.time, *(part[:, order] for part in parts.values())])
    lines = [",".join(f"{cell:.12g}" for cell in row) for row in table.tolist()]
    options = LogOptions(payload=Payload(), gravity=arm[1])
    return robot, read_log("\n".join([",".join(header), *lines]).encode(), robot, options).log


def found_by(
    recordings: tuple[Recording, Recording], arm: Arm, options: IdentificationOptions, drawn: bool
) -> tuple[Identification, Validation]:
    """The figures from the first recording, and their errors on the second one."""
    (robot, log), (_, other) = (log_of(each, arm, drawn) for each in recordings)
    found = identify(robot, [log], options)
    return found, found.validate([other])


@pytest.mark.parametrize(
    ("nq", "drawings", "refit"),
    long_but(
        [(5, EVERY, False)],
        [
            *((6, (each,), False) for each in EVERY),
            *((nq, EVERY, refit) for nq in (5, 6, 7) for refit in (False, True)),
        ],
    ),
)
def test_the_same_motion_of_the_same_arm_has_the_same_prediction(
    nq: int, drawings: tuple[Drawing, ...], refit: bool
) -> None:
    arm = drawn(nq)
    other, options = reduce(lambda one, draw: draw(one), drawings, arm), WITHOUT_SPLIT
    robot = robot_of(arm)
    truth = replace(truth_of(robot), payload=Payload())
    recordings = tuple(recorded(robot, truth, 6, 100.0, seed) for seed in (1, 2))
    assert len(recordings) == 2
    _check_drawing(arm, other, recordings[0])
    options = replace(options, refit=refit)
    found, errors = found_by(recordings, arm, options, False)
    drawn_found, drawn_errors = found_by(recordings, other, options, True)

    energies, drawn_energies = (
        np.array([[each.measured, each.predicted, each.p95 - each.p5] for each in part.energies])
        for part in (errors, drawn_errors)
    )
    same, same_width = (SAME_OF_LINKS, SAME_WIDTH_OF_LINKS) if refit else (SAME, SAME_WIDTH)
    np.testing.assert_allclose(drawn_energies[:, :2], energies[:, :2], rtol=same)
    np.testing.assert_allclose(drawn_energies[:, 2], energies[:, 2], rtol=same_width)
    sign = np.array([each.sign for each in other[0]])
    torques = errors.curves.modelled_torque
    size = np.nanmax(np.abs(torques), axis=0)
    np.testing.assert_allclose(
        drawn_errors.curves.modelled_torque * sign / size, torques / size, atol=same
    )
    # parameters of single links depend on their frames
    letters, drawn_letters = (
        [(p.figure, p.joint, p.identified) for p in each.parameters if "inertials" not in p.figure]
        for each in (found, drawn_found)
    )
    assert letters == drawn_letters and any(identified for *_, identified in letters)


def _check_drawing(arm: Arm, other: Arm, recording: Recording) -> None:
    """Check that both drawings are of the same arm, by the torques of Pinocchio on their URDF."""
    rows, torques = slice(None, None, 100), list[Array]()
    for links, gravity in (arm, other):
        model = pin.buildModelFromXML(urdf_of((links, gravity)))
        model.gravity.linear = gravity
        sign, zero = (
            np.array([getattr(each, name) for each in links]) for name in ("sign", "zero")
        )
        states = (sign * recording.exact_q - zero, sign * recording.exact_v, sign * recording.a)
        torques.append(sign * torques_of(model, *(each[rows] for each in states)))
    np.testing.assert_allclose(torques[1], torques[0], atol=1e-9 * np.abs(torques[0]).max())
