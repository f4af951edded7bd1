"""Corners of COLLADA files, in metres, in the placement of their scenes."""

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
    """A translation, then a quarter turn about z, then a scale, then a matrix with a shift."""
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
    "faces",
    [
        '<triangles count="1"><input semantic="NORMAL" offset="0"/>'
        '<input semantic="VERTEX" offset="1"/><p>9 0  9 1  9 3</p></triangles>',
        '<polylist count="1"><input semantic="VERTEX" offset="0"/>'
        '<input semantic="TEXCOORD" offset="2"/><vcount>3</vcount><p>0 7 7 1 7 7 3 7 7</p>'
        "</polylist>",
        '<polygons count="2"><input semantic="VERTEX" offset="0"/><p>0 1</p>'
        "<ph><p>1 3</p><h>2</h></ph></polygons>",
    ],
    ids=["triangles", "polylist", "polygons"],
)
def test_corners_without_a_face_do_not_count(faces: str) -> None:
    """Parts of one body may share the corners of all."""
    content = file_of(INSTANCE).replace(b"</mesh>", f"{faces}</mesh>".encode())
    found = collada_corners(content, MeshSize(), unwatched)
    assert found == pytest.approx(CORNERS[[0, 1, 3]] * 1e-3)


def test_an_empty_line_before_the_declaration_has_no_effect() -> None:
    content = file_of(INSTANCE)
    spaced = b"  \n" + content.removeprefix("\ufeff".encode())
    found = collada_corners(spaced, MeshSize(), unwatched)
    assert np.array_equal(found, collada_corners(content, MeshSize(), unwatched))


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"<robot/>", "not a COLLADA"),
        (
            file_of(INSTANCE).replace(b"</mesh>", b"<triangles><p>0 1 4</p></triangles></mesh>"),
            "faces with corners outside",
        ),
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
