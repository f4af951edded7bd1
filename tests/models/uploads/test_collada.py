"""Corners of COLLADA files: where their scenes place them, in metres."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.uploads.collada import collada_corners
from joulepath.models.uploads.limits import UnreadableFile, unwatched
from joulepath.models.uploads.mesh_text import MeshSize

CORNERS = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 50.0, 0.0], [0.0, 0.0, 25.0]])
GEOMETRY = f"""<library_geometries><geometry id="block"><mesh>
  <source id="places"><float_array id="a" count="12">{" ".join(map(str, CORNERS.ravel()))}
  </float_array><technique_common><accessor source="#a" count="4" stride="3"/></technique_common>
  </source><vertices id="v"><input semantic="POSITION" source="#places"/></vertices>
</mesh></geometry></library_geometries>"""
INSTANCE = '<instance_geometry url="#block"/>'


def file_of(nodes: str, more: str = "") -> bytes:
    scenes = f"<library_visual_scenes><visual_scene id='s'>{nodes}</visual_scene>"
    text = (
        '<?xml version="1.0" encoding="utf-8"?><COLLADA xmlns="http://www.collada.org/" '
        'version="1.4.1"><asset><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis>'
        f"</asset>{GEOMETRY}{more}{scenes}</library_visual_scenes></COLLADA>"
    )
    return ("\ufeff" + text).encode()


def read(nodes: str, more: str = "") -> np.ndarray:
    return collada_corners(file_of(nodes, more), MeshSize(), unwatched)


def test_nested_transformations_apply_from_the_outermost() -> None:
    """A translation, then a quarter turn about z, then a scale, then a matrix that shifts."""
    nodes = (
        "<node><translate>10 0 0</translate><rotate>0 0 2 90</rotate><node><scale>2 1 1</scale>"
        f"<matrix>1 0 0 1  0 1 0 0  0 0 1 0  0 0 0 1</matrix>{INSTANCE}</node></node>"
    )
    x, y, z = CORNERS.T
    expected = np.column_stack([10 - y, 2 * (x + 1), z]) * 1e-3
    assert read(nodes) == pytest.approx(expected)


def test_geometries_used_twice_and_nodes_of_a_library() -> None:
    library = f'<library_nodes><node id="part">{INSTANCE}</node></library_nodes>'
    shifted = '<translate>0 0 7</translate><instance_node url="#part"/>'
    nodes = f"<node>{INSTANCE}</node><node>{shifted}</node>"
    found = read(nodes, library)
    assert found == pytest.approx(np.vstack([CORNERS, CORNERS + np.array([0, 0, 7])]) * 1e-3)


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"<robot/>", "no COLLADA"),
        (b"<COLLADA><", "not XML"),
        (file_of("<node><instance_geometry url='#other'/></node>"), "'other'"),
        (file_of("<node><matrix>1 2</matrix></node>"), "16 numbers"),
        (file_of("<node id='n'><instance_node url='#n'/></node>"), "loop"),
        (b"<!DOCTYPE x [<!ENTITY e 'e'>]><COLLADA/>", "document type"),
    ],
)
def test_unreadable_files(content: bytes, cause: str) -> None:
    with pytest.raises(UnreadableFile, match=cause):
        collada_corners(content, MeshSize(), unwatched)


def test_copies_count() -> None:
    with pytest.raises(UnreadableFile, match="more than 7 corners"):
        collada_corners(file_of(f"<node>{INSTANCE}{INSTANCE}</node>"), MeshSize(7, 7), unwatched)
