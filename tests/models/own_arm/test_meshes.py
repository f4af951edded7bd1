"""Meshes of a user's own arm: found by their paths, with every triangle inside a capsule."""

from __future__ import annotations

import dataclasses
import io
import random
import zipfile
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.spatial import ConvexHull

from joulepath.models.capsule_cover import not_held, outside
from joulepath.models.hull_cover import HULL_FIT
from joulepath.models.hull_parts import QUICK, divided, nowhere
from joulepath.models.meshes import link_surfaces
from joulepath.models.own_arm.capsule_around import SEARCH, capsule_around
from joulepath.models.own_arm.description import Description, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.mesh_files import in_folder, in_zip, surface
from joulepath.models.robot import Array, LinkCapsule
from joulepath.models.uploads.limits import LIMITS
from joulepath.optimizer.problem.robots import load_robot
from tests.mesh_folders import meshes as arm_folder
from tests.models.own_arm.arms import PLAIN, RICH, RICH_ARM, URDF, changed, meshed, robot
from tests.selection import long_but

NAMED = RICH.replace(
    '"forearm.stl"', '"package://cell/meshes/forearm.stl" scale="0.001 0.001 0.001"'
)
UPPER_ARM = pin.SE3(pin.rpy.rpyToMatrix(np.pi / 2, 0.0, 0.0), np.array([0.0, -0.2, 0.0]))
"""The collision shape of the plain arm in the frame of its link."""
# [mm], as a drawing program writes it
BLOCK = trimesh.creation.box((180.0, 60.0, 40.0))


def stl(mesh: trimesh.Trimesh) -> bytes:
    return bytes(mesh.export(file_type="stl"))


def zipped(files: dict[str, bytes]) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return target.getvalue()


def in_upper_arm(points: Array) -> Array:
    """Points (n, 3) [m] of the collision shape of the plain arm, in the frame of its link."""
    return np.asarray(points @ UPPER_ARM.rotation.T + UPPER_ARM.translation)


def volume(axis: Array, radius: float) -> float:
    return float(np.pi * radius**2 * (np.linalg.norm(axis[1] - axis[0]) + 4 / 3 * radius))


@pytest.mark.parametrize("link", long_but((0, 2), range(7)))
def test_a_capsule_holds_every_triangle_of_a_link(link: int) -> None:
    """For a real arm, the capsule is at most 2.6 times as large as the hull."""
    surface = link_surfaces(arm_folder("ur5e"), "ur5e", link)["visual"]
    points = surface.reshape(-1, 3)
    axis, radius = capsule_around(points)
    assert not len(not_held(surface, [LinkCapsule(link, axis, radius)]))
    assert len(not_held(surface, [LinkCapsule(link, axis, radius - 2e-3)]))
    assert volume(axis, radius) < 2.6 * ConvexHull(points).volume


@pytest.mark.parametrize("seed", long_but(range(2), range(5)))
def test_a_capsule_is_found_again(seed: int) -> None:
    """Points on a capsule: none is smaller, and the search comes within 2 % of its volume."""
    rng = np.random.default_rng(seed)
    ends, radius = rng.uniform(-0.3, 0.3, (2, 3)), rng.uniform(0.02, 0.1)
    share = rng.uniform(size=(3000, 1))
    outward = rng.normal(size=(3000, 3))
    outward *= radius / np.linalg.norm(outward, axis=1, keepdims=True)
    # half balls at the ends, rings between
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    ring = outward - (outward @ along)[:, None] * along
    ring *= radius / np.linalg.norm(ring, axis=1, keepdims=True)
    points = np.concatenate(
        [ends[0] + outward, ends[1] + outward, ends[0] + share * (ends[1] - ends[0]) + ring]
    )
    found, reach = capsule_around(points)
    assert volume(found, reach) < 1.02 * volume(ends, radius) + SEARCH.digit * np.pi * radius


@pytest.mark.parametrize(
    "points", [np.zeros((5, 3)), np.eye(3)[[0, 1, 2, 0]], np.outer(np.arange(6.0), [1, 0, 0]) / 10]
)
def test_flat_and_thin_meshes_have_a_capsule(points: Array) -> None:
    axis, radius = capsule_around(points)
    share = np.clip(
        (points - axis[0]) @ (axis[1] - axis[0]) / max(np.sum((axis[1] - axis[0]) ** 2), 1e-30),
        0,
        1,
    )
    assert (
        np.linalg.norm(points - axis[0] - share[:, None] * (axis[1] - axis[0]), axis=1).max()
        <= radius + 1e-12
    )


def test_a_mesh_of_the_urdf_is_held_where_it_stands(tmp_path: Path) -> None:
    """Named by a package, in millimetres, in a folder or a zip."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "forearm.stl").write_bytes(stl(BLOCK))
    by_folder = in_folder(tmp_path, NAMED)
    by_zip = in_zip(
        zipped({"cell/meshes/forearm.stl": stl(BLOCK), "cell/meshes/other.stl": b"", "a.txt": b"?"})
    )
    for files in (by_folder, by_zip):
        made = robot(dataclasses.replace(RICH_ARM, urdf=NAMED, meshes=files))
        # the cylinder and the mesh
        cylinder, block = [each for each in made.capsules if each.link == 2]
        assert cylinder.radius == pytest.approx(0.04)
        half = np.array([0.09, 0.03, 0.02])
        assert np.hypot(*half[1:]) <= block.radius < 1.4 * np.hypot(*half[1:])
        # the mesh's origin is the URDF link `forearm`, 0.05 and 0.1 m from the joint by the bracket
        assert np.linalg.norm(block.axis.mean(axis=0)) == pytest.approx(
            np.hypot(0.05, 0.1), abs=5e-3
        )


CYLINDER = '<collision><origin xyz="0.1 0 0" rpy="0 1.57 0"/>'
ALONE = NAMED[: NAMED.index(CYLINDER)] + NAMED[NAMED.index("<collision><geometry><mesh") :]
"""The mesh is the only shape of its link."""


def test_a_link_of_shapes_with_corners_has_hulls_of_them() -> None:
    """Links with capsules of the user, with a ball, or without a mesh have no hulls. The block is
    at the mesh's origin in the URDF."""
    files = {"forearm.stl": stl(BLOCK)}
    asked = dataclasses.replace(RICH_ARM, urdf=ALONE, meshes=files)
    (hull,) = [each for each in robot(asked).hulls if each.link == 2]
    (capsule,) = [each for each in robot(asked).capsules if each.link == 2]
    assert len(hull.points) == 8
    assert ConvexHull(hull.points).volume == pytest.approx(0.18 * 0.06 * 0.04, rel=0.01)
    assert hull.points.mean(axis=0) == pytest.approx(capsule.axis.mean(axis=0), abs=5e-3)
    both = [each for each in robot(dataclasses.replace(asked, urdf=NAMED)).hulls if each.link == 2]
    assert len(both) == 2
    forearm = {"forearm": [(0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.05)]}
    own = dataclasses.replace(asked.collision, capsules=forearm)
    ball = ALONE.replace(
        "<collision><geometry><mesh",
        '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
        "<collision><geometry><mesh",
    )
    for other in (
        dataclasses.replace(asked, urdf=ball),
        dataclasses.replace(asked, collision=own),
        dataclasses.replace(asked, meshes={}),
    ):
        assert 2 not in {each.link for each in robot(other).hulls}


def test_the_hull_of_a_cylinder_holds_it_closely() -> None:
    """The prism around it reaches 0.4 mm beyond, and the grown hull 2.7 mm beyond the prism."""
    (hull,) = [each for each in robot(PLAIN).hulls if each.link == 1]
    turn = 2 * np.pi * np.arange(200) / 200
    around = np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn)], axis=1)
    ends = [np.column_stack([around, np.full(200, z)]) for z in (-0.15, 0.15)]
    found = outside(in_upper_arm(np.concatenate(ends)), [hull])
    assert found.min() >= -0.0027 - 4.4e-4 and found.max() <= 0.0


def test_a_bent_mesh_has_hulls_of_its_parts() -> None:
    """All triangles are inside the hulls, and the bend is free; a single hull would fill it."""
    arms = [trimesh.creation.box((180.0, 50.0, 40.0)), trimesh.creation.box((50.0, 180.0, 40.0))]
    arms[0].apply_translation((65.0, 0.0, 0.0))
    arms[1].apply_translation((0.0, 65.0, 0.0))
    bent = trimesh.util.concatenate(arms)
    text = meshed('scale="0.001 0.001 0.001"').replace("link.obj", "link.stl")
    made = robot(changed(urdf=text, meshes={"link.stl": stl(bent)}))
    hulls = [each for each in made.hulls if each.link == 1]
    assert len(hulls) > 1
    triangles = in_upper_arm(bent.triangles.reshape(-1, 3) / 1000).reshape(-1, 3, 3)
    assert not len(not_held(triangles, hulls))
    assert outside(in_upper_arm(np.array([[0.1, 0.1, 0.0]])), hulls).min() > 0.03


@pytest.mark.parametrize("seed", long_but(range(3), range(40)))
def test_hulls_hold_bodies_of_any_form(seed: int) -> None:
    """Random blocks side by side, in a mesh with uneven and sometimes mirroring scales."""
    rng = np.random.default_rng(seed)
    blocks = [trimesh.creation.box(rng.uniform(10.0, 150.0, 3)) for _ in range(2 + seed % 4)]
    for block in blocks:
        turned = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))
        block.apply_transform(turned)
        block.apply_translation(rng.uniform(-80.0, 80.0, 3))
    body = trimesh.util.concatenate(blocks)
    scale = rng.choice([-1e-3, 1e-3], 3) * rng.uniform(0.5, 1.5, 3)
    text = meshed(f'scale="{scale[0]} {scale[1]} {scale[2]}"').replace("link.obj", "link.stl")
    made = robot(changed(urdf=text, meshes={"link.stl": stl(body)}))
    hulls = [each for each in made.hulls if each.link == 1]
    triangles = in_upper_arm(body.triangles.reshape(-1, 3) * scale).reshape(-1, 3, 3)
    assert hulls and not len(not_held(triangles, hulls))


@pytest.mark.parametrize("seed", long_but(range(4), range(60)))
def test_meshes_of_any_triangles_are_held_or_refused(seed: int) -> None:
    """Triangles with random corners, mostly without volume, of 10 um to 1 m."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1.0, 1.0, (rng.integers(4, 60), 3)) * 10 ** rng.uniform(-5.0, 0.0, 3)
    faces = rng.integers(0, len(corners), (rng.integers(4, 100), 3))
    body = trimesh.Trimesh(corners * (1.0, 1.0, seed % 3 > 0), faces, process=False)
    text = meshed("").replace("link.obj", "link.stl")
    try:
        made = robot(changed(urdf=text, meshes={"link.stl": stl(body)}))
    except InvalidArm:
        return
    covers = [each for each in (*made.hulls, *made.capsules) if each.link == 1]
    triangles = np.asarray(body.triangles, np.float32).astype(float).reshape(-1, 3)
    assert not len(not_held(in_upper_arm(triangles).reshape(-1, 3, 3), covers))


def test_a_body_smaller_than_the_growth_of_hulls_is_divided() -> None:
    """The hulls of its parts contain one another."""
    rng = np.random.default_rng(41)
    body = rng.uniform(-1.5e-3, 1.5e-3, (40, 3, 3))
    assert 1 <= len(divided([body], HULL_FIT.radius, nowhere, QUICK)) <= QUICK.most


@pytest.mark.parametrize("thickness", [0.0, 0.04])
def test_a_sheet_has_a_hull_and_is_compared(thickness: float) -> None:
    """A sheet [mm] thinner than the last digit of its hull's points."""
    sheet = trimesh.creation.box((180.0, 60.0, 40.0))
    sheet.vertices[:, 2] *= thickness / 40.0
    text = meshed('scale="0.001 0.001 0.001"').replace("link.obj", "link.stl")
    made = robot(changed(urdf=text, meshes={"link.stl": stl(sheet)}))
    hulls = [each for each in made.hulls if each.link == 1]
    triangles = in_upper_arm(sheet.triangles.reshape(-1, 3) / 1000).reshape(-1, 3, 3)
    assert len(hulls) == 1 and not len(not_held(triangles, hulls))
    assert not made.never_in_collision


def test_links_whose_hulls_are_apart_are_compared() -> None:
    """The capsule around a wide plate beneath the arm meets the forearm everywhere."""
    plate = '<collision><geometry><box size="1.5 1.5 0.02"/></geometry></collision>'
    rod = '<collision><origin xyz="0 0 0.15"/><geometry>{}</geometry></collision>'
    for shape, excluded in (
        ('<cylinder radius="0.03" length="0.3"/>', set()),
        ('<capsule radius="0.03" length="0.3"/>', set()),
    ):
        text = URDF.replace('<link name="base"/>', f'<link name="base">{plate}</link>')
        text = text.replace('<link name="forearm">', '<link name="forearm">' + rod.format(shape))
        assert robot(changed(urdf=text)).never_in_collision == excluded
    rows = {"base": [(-0.75, 0.0, 0.0, 0.75, 0.0, 0.0, 0.76)]}
    by_capsules = changed(urdf=text, collision=dataclasses.replace(PLAIN.collision, capsules=rows))
    assert robot(by_capsules).never_in_collision == {(0, 2)}


def test_a_missing_mesh_is_told() -> None:
    figures, warnings = own_figures("mine", dataclasses.replace(RICH_ARM, urdf=NAMED, meshes={}))
    assert any("package://cell/meshes/forearm.stl" in warning for warning in warnings)
    assert len(figures["collision"]["elbow_link"]["value"]) == 1


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"forearm.stl": b"solid nothing"}, "must have from 4"),
        ({"forearm.stl": b"\x00" * 80 + b"\xff\xff\xff\x7f"}, "shorter than its header says"),
        ({"forearm.stl": stl(trimesh.creation.box((9e3, 1.0, 1.0)))}, "larger than 5 m"),
        (
            {
                "a/meshes/forearm.stl": stl(BLOCK),
                "b/meshes/forearm.stl": stl(trimesh.creation.icosphere()),
            },
            "Several files",
        ),
    ],
)
def test_a_mesh_that_is_none_is_named(files: dict[str, bytes], words: str) -> None:
    with pytest.raises(InvalidArm, match=words) as found:
        own_figures("mine", dataclasses.replace(RICH_ARM, urdf=NAMED, meshes=files))
    assert found.value.field == "meshes"


def test_the_longest_agreement_of_paths_counts() -> None:
    files = {
        "left/arm/link.stl": stl(BLOCK),
        "right/arm/link.stl": stl(trimesh.creation.icosphere()),
    }
    found = surface(files, "package://cell/right/arm/link.stl")
    assert found is not None and np.linalg.norm(found[0], axis=1).max() == pytest.approx(1.0)
    assert surface(files, "package://cell/right/arm/hand.stl") is None
    # no step out of the folder
    assert in_folder(Path("/tmp/nowhere"), '<mesh filename="../../../etc/passwd.stl"/>') == {}


def test_a_zip_that_is_none_or_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidArm, match="not a readable zip"):
        in_zip(b"PK")
    monkeypatch.setattr(
        "joulepath.models.own_arm.mesh_files.LIMITS", dataclasses.replace(LIMITS, mesh_bytes=10_000)
    )
    with pytest.raises(InvalidArm, match="unpacks to more"):
        in_zip(zipped({"a.stl": b"0" * 20_000}))
    monkeypatch.setattr(
        "joulepath.models.own_arm.mesh_files.LIMITS", dataclasses.replace(LIMITS, mesh_files=1)
    )
    with pytest.raises(InvalidArm, match="2 mesh files"):
        in_zip(zipped({"a.stl": b"0", "b.obj": b"0"}))


@pytest.mark.parametrize(
    "method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA]
)
def test_a_broken_zip_is_refused_as_what_it_is(method: int) -> None:
    """300 mutants of each compression method."""
    target, chance, refused = io.BytesIO(), random.Random(method), 0
    with zipfile.ZipFile(target, "w", method) as archive:
        archive.writestr("a.stl", bytes(range(256)) * 20)
        archive.writestr("b/c.obj", b"v 0 0 0\n" * 50)
    for _ in range(300):
        content = bytearray(target.getvalue())
        for _ in range(chance.choice([1, 2, 5])):
            content[chance.randrange(len(content))] = chance.randrange(256)
        try:
            in_zip(bytes(content))
        except InvalidArm:
            refused += 1
    assert refused > 30


@pytest.mark.long
def test_an_arm_of_others_with_its_meshes(tmp_path: Path) -> None:
    """The UR5e by its visual meshes: every link is within its capsule and its hull, as the bundled
    robot's are."""
    text = (
        (arm_folder("ur5e") / "ur5e.urdf")
        .read_text()
        .replace("<collision>", "<!--")
        .replace("</collision>", "-->")
    )
    text = text.replace("<visual>", "<collision>").replace("</visual>", "</collision>")
    text = "\n".join(line for line in text.splitlines() if "<!-- " not in line)
    files = in_folder(arm_folder("ur5e"), text)
    made = robot(
        Description(
            urdf=text,
            tip="tool0",
            base="base_link_inertia",
            acceleration=9.0,
            payload=5.0,
            meshes=files,
        )
    )
    assert len(files) >= 7 and {each.link for each in made.capsules} == set(range(7))
    for link in range(1, 7):
        surface = link_surfaces(arm_folder("ur5e"), "ur5e", link)["visual"]
        assert not len(not_held(surface, [each for each in made.capsules if each.link == link]))
        assert not len(not_held(surface, [each for each in made.hulls if each.link == link]))
    assert load_robot("ur5e").nq == made.nq
