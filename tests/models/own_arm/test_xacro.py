"""Descriptions of arms with xacro macros, in ROS packages."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from joulepath import InvalidArm, load_robot
from joulepath.models.own_arm.reading import read_description
from tests.models.own_arm.arms import PLAIN, SHAPE

MACROS = """<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="length" default="0.4"/>
<xacro:macro name="place" params="z"><origin xyz="0 0 ${z}"/></xacro:macro></robot>"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A description next to its package, with macros of another package and a mesh."""
    for package, name, text in (
        ("cell_arm", "arm.urdf.xacro", _arm()),
        ("macros", "places.xacro", MACROS),
    ):
        folder = tmp_path / "src" / package
        (folder / "urdf").mkdir(parents=True)
        (folder / "package.xml").write_text(
            f'<package format="3"><name>{package}</name><version>1.0.0</version><description>an arm'
            '</description><maintainer email="a@b.c">a</maintainer><license>MIT</license></package>'
        )
        (folder / "urdf" / name).write_text(text)
    meshes = tmp_path / "src" / "cell_arm" / "meshes"
    meshes.mkdir()
    block = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .3\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
    (meshes / "block.obj").write_text(block)
    described = tmp_path / "mine.yaml"
    described.write_text(
        "urdf: src/cell_arm/urdf/arm.urdf.xacro\ntip: tool\nacceleration: 8\npayload: 2\n"
    )
    return described


def _arm() -> str:
    plain = PLAIN.urdf.replace(
        '<robot name="example">',
        '<robot name="example" xmlns:xacro="http://ros.org/wiki/xacro">'
        '<xacro:include filename="$(find macros)/urdf/places.xacro"/>',
    )
    macro = plain.replace('<origin xyz="0 0 0.4"/>', '<xacro:place z="$(arg length)"/>')
    assert macro != plain
    return macro.replace(SHAPE, '<mesh filename="package://cell_arm/meshes/block.obj"/>')


def test_macros_packages_and_arguments(arm: Path) -> None:
    """The package next to the file's own is found, and an argument changes the arm."""
    pytest.importorskip("xacrodoc")
    found = read_description(arm)
    assert "xacro:place" not in found.urdf and 'xyz="0 0 0.4"' in found.urdf
    assert list(found.meshes or {}) == ["package://cell_arm/meshes/block.obj"]
    length = load_robot(arm).figures["kinematics"]["joint_origin"]["value"]
    arm.write_text(arm.read_text() + "arguments: {length: 0.5}\n")
    assert load_robot(arm).figures["kinematics"]["joint_origin"]["value"] != length


def test_packages_elsewhere(arm: Path, tmp_path: Path) -> None:
    pytest.importorskip("xacrodoc")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "src" / "macros").rename(tmp_path / "elsewhere" / "macros")
    with pytest.raises(InvalidArm, match=r"xacro: Package not found: macros\. .*`packages`"):
        read_description(arm)
    arm.write_text(arm.read_text() + "packages: elsewhere\n")
    assert 'xyz="0 0 0.4"' in read_description(arm).urdf


def test_meshes_of_a_repository_in_a_workspace(arm: Path, tmp_path: Path) -> None:
    """The packages of a maker's repository are one level below the folder of the workspace."""
    pytest.importorskip("xacrodoc")
    maker = tmp_path / "elsewhere" / "maker"
    maker.mkdir(parents=True)
    (maker / "back").symlink_to(maker, target_is_directory=True)
    (tmp_path / "src" / "macros").rename(maker / "macros")
    (tmp_path / "src" / "cell_arm" / "meshes").rename(maker / "macros" / "meshes")
    file = tmp_path / "src" / "cell_arm" / "urdf" / "arm.urdf.xacro"
    file.write_text(file.read_text().replace("cell_arm/meshes", "macros/meshes"))
    arm.write_text(arm.read_text() + "packages: elsewhere\n")
    assert list(read_description(arm).meshes or {}) == ["package://macros/meshes/block.obj"]


def test_a_file_of_macros_alone(arm: Path) -> None:
    pytest.importorskip("xacrodoc")
    arm.write_text(arm.read_text().replace("cell_arm/urdf/arm.urdf", "macros/urdf/places"))
    with pytest.raises(InvalidArm, match="name the file that uses them"):
        load_robot(arm)


@pytest.mark.parametrize(
    ("line", "field"), [("packages: none", "packages"), ("arguments: 3", "arguments")]
)
def test_wrong_packages_and_arguments(arm: Path, line: str, field: str) -> None:
    arm.write_text(f"{arm.read_text()}{line}\n")
    with pytest.raises(InvalidArm) as caught:
        read_description(arm)
    assert caught.value.field == field


def test_without_the_package(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(InvalidArm, match=r"joulepath\[xacro\]"):
        read_description(arm)
