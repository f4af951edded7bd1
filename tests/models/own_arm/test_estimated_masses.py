"""Missing masses of a URDF, from volumes or from the user, and impossible inertias."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.own_arm.description import Description
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.robot_xml import TENSOR
from joulepath.models.possible_inertia import nearest_possible_inertia
from tests.models.own_arm.arms import BLOCK, PLAIN, SHAPE, obj, refused, robot

BOX = '<visual><origin xyz="0 0 0.1" rpy="0 0 1"/><geometry>{}</geometry></visual>'
FOREARM = '<link name="forearm">'
BOXED = PLAIN.urdf.replace(FOREARM, FOREARM + BOX.format('<box size="0.1 0.06 0.2"/>'))
WITHOUT = re.sub(r"<inertial>.*?</inertial>", "", BOXED, flags=re.S)
BARE = replace(PLAIN, urdf=WITHOUT)
# kg, m³: of the cylinder of the upper arm and the box of the forearm
CYLINDER = np.pi * 0.05**2 * 0.3
CUBOID = 0.1 * 0.06 * 0.2
# error of a mesh with flat faces against a round body
FACETED = 0.01
FLAT = (
    'izz="0.004"',
    'izz="0.2"',
)


def bodies(description: Description) -> list[pin.Inertia]:
    return list(robot(description).model.inertias)[1:]


def test_a_link_without_a_mass_is_refused_with_the_mend() -> None:
    refused("urdf", "give `masses`, or `density`", BARE)


def test_masses_follow_from_the_volumes_with_the_letter_of_a_default() -> None:
    upper, lower = bodies(replace(BARE, density=1000.0))
    assert upper.mass == pytest.approx(1000 * CYLINDER, rel=FACETED)
    assert lower.mass == pytest.approx(1000 * CUBOID)
    levers = [np.linalg.norm(each.lever) for each in (upper, lower)]
    assert levers == pytest.approx([0.2, 0.1])
    turned = pin.rpy.rpyToMatrix(0, 0, 1)
    own = lower.mass / 12 * np.diag([0.06**2 + 0.2**2, 0.1**2 + 0.2**2, 0.1**2 + 0.06**2])
    expected = np.linalg.eigvalsh(turned @ own @ turned.T)
    assert np.linalg.eigvalsh(lower.inertia) == pytest.approx(expected)
    figures, warnings = own_figures("mine", replace(BARE, density=1000.0))
    letters = {figures["inertials"][part]["trust"] for part in ("mass", "inertia")}
    assert letters == {"E"} and "estimated: upper_arm, forearm" in warnings[0]


def test_a_total_mass_is_met_by_the_sum_of_all_links() -> None:
    upper, lower = bodies(replace(BARE, masses=10.0))
    assert upper.mass + lower.mass == pytest.approx(10.0)
    assert upper.mass / lower.mass == pytest.approx(CYLINDER / CUBOID, rel=FACETED)
    half = replace(PLAIN, urdf=re.sub(r"<inertial>.*?</inertial>", "", BOXED, count=1, flags=re.S))
    assert [each.mass for each in bodies(replace(half, masses=9.0))] == pytest.approx([7.0, 2.0])
    refused("masses", "a total must be above this", replace(half, masses=1.5))


def test_a_mass_of_zero_is_none() -> None:
    """Exporters write zeros for bodies without a given mass."""
    zeros = "".join(f' {part}="0"' for part in TENSOR)
    inertial = f'<inertial><mass value="0"/><inertia{zeros}/></inertial>'
    empty = replace(PLAIN, urdf=re.sub(r"<inertial>.*?</inertial>", inertial, BOXED, flags=re.S))
    refused("urdf", "give `masses`, or `density`", empty)
    for given in ({"density": 1000.0}, {"masses": 10.0}, {"masses": {"forearm": 1.0}}):
        bare = own_figures("mine", replace(BARE, **given))
        assert own_figures("mine", replace(empty, **given)) == bare
    # without a shape, the mass alone is replaced
    shapeless = replace(empty, urdf=re.sub(r"<visual>.*?</visual>", "", empty.urdf, flags=re.S))
    assert bodies(replace(shapeless, masses={"forearm": 2.5}))[1].mass == 2.5
    refused(
        "urdf", "'forearm', with what is fixed to it, has no mass", replace(shapeless, density=9.0)
    )


def test_what_has_no_effect_is_refused() -> None:
    told = "Every link with a shape has an <inertial>, 5 kg in all"
    refused("masses", told, replace(PLAIN, masses=99.0))
    refused("density", told, replace(PLAIN, density=1000.0))
    refused("density", told, replace(PLAIN, masses={"forearm": 2.0}, density=1000.0))


def test_masses_of_links_replace_those_of_the_urdf() -> None:
    given = replace(PLAIN, masses={"forearm": 5.0})
    (upper, lower), (_, before) = bodies(given), bodies(PLAIN)
    assert (upper.mass, lower.mass) == (3.0, 5.0)
    assert lower.inertia == pytest.approx(2.5 * before.inertia)
    assert lower.lever == pytest.approx(before.lever)
    of_both = bodies(replace(BARE, masses={"upper_arm": 4.0, "forearm": 1.0}))
    assert [each.mass for each in of_both] == pytest.approx([4.0, 1.0])
    flat = replace(BARE, urdf=WITHOUT.replace("0.1 0.06 0.2", "0 0 0"), density=1000.0)
    refused("urdf", "'forearm', with what is fixed to it, has no mass", flat)
    refused("masses", "No moving link has the name 'hand'", replace(PLAIN, masses={"hand": 1.0}))
    no_shape = re.sub(r"<visual>.*?</visual>", "", WITHOUT, flags=re.S)
    refused(
        "masses",
        "neither an <inertial> nor a shape",
        replace(BARE, urdf=no_shape, masses={"forearm": 1.0}),
    )


def test_a_mesh_counts_by_its_convex_hull() -> None:
    mesh = '<mesh filename="link.obj" scale="0.001 0.001 0.001"/>'
    given = replace(BARE, urdf=WITHOUT.replace(SHAPE, mesh), density=1000.0)
    upper = bodies(replace(given, meshes={"link.obj": obj(BLOCK)}))[0]
    assert upper.mass == pytest.approx(1000 * 0.18 * 0.06 * 0.04)
    assert upper.inertia.trace() == pytest.approx(upper.mass / 6 * (0.18**2 + 0.06**2 + 0.04**2))
    refused("urdf", "'upper_arm', with what is fixed to it, has no mass", given)


def test_an_impossible_inertia_is_mended_on_request_alone() -> None:
    given = replace(PLAIN, urdf=PLAIN.urdf.replace(*FLAT))
    refused("urdf", "or set `mend_inertias`", given)
    mended = replace(given, mend_inertias=True)
    least, middle, most = np.linalg.eigvalsh(bodies(mended)[0].inertia)
    assert least >= 0 and most <= (least + middle) * (1 + 1e-9)
    figures, warnings = own_figures("mine", mended)
    assert figures["inertials"]["inertia"]["trust"] == "E"
    assert figures["inertials"]["mass"]["trust"] == "C"
    assert "nearest possible ones: upper_arm." in warnings[0]
    # an arm without a fault stays as it is
    assert own_figures("mine", replace(PLAIN, mend_inertias=True)) == own_figures("mine", PLAIN)


def test_the_nearest_possible_inertia() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        points = rng.normal(size=(12, 3))
        body = sum(float(p @ p) * np.eye(3) - np.outer(p, p) for p in points)
        assert nearest_possible_inertia(np.asarray(body)) == pytest.approx(np.asarray(body))
        wild = rng.normal(size=(3, 3))
        found = nearest_possible_inertia(wild + wild.T)
        least, middle, most = np.linalg.eigvalsh(found)
        assert least >= -1e-12 and most <= least + middle + 1e-12
        # a second correction changes nothing
        assert nearest_possible_inertia(found) == pytest.approx(found, abs=1e-12)
