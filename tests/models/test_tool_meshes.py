"""Grippers at every opening: motion of the fingers, and the proof of containment in their hulls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.covers import unproven
from joulepath.models.capsule_cover import not_held
from joulepath.models.fit_tool_hulls import fitted_hulls
from joulepath.models.hull_cover import HULL_FIT, from_hull
from joulepath.models.robot import LinkCapsule, LinkHull
from joulepath.models.tool_meshes import (
    FARTHEST,
    TOOL_MESHES,
    Joint,
    Part,
    Piece,
    between,
    on_flange,
)
from joulepath.models.tools.registry import tool_figures, tool_names
from tests.mesh_folders import meshes
from tests.selection import long_but

ROBOTIQ = "robotiq_2f_85"
# m: by the maker's data sheet, the fingers open 85 mm wide
OPEN = 0.085
OPENING = 2e-3
# m: the pads touch when closed, but for the last thousandths of a radian
CLOSED = 5e-4
# the greatest sagitta belongs to the farthest corner, by the first term of its series
SERIES = 1e-3


def hulls(name: str) -> list[LinkHull]:
    figures = tool_figures(name)
    radius = figures["hull_radius"]["value"]
    return [LinkHull(0, np.array(points), radius) for points in figures["hulls"]["value"]]


def test_the_pads_of_the_robotiq_touch_when_closed_and_open_by_its_stroke() -> None:
    """The pads move along y and stay upright; the TCP is at the height of their middle if open."""
    tool = TOOL_MESHES[ROBOTIQ]
    pads = [
        swept
        for part in tool.parts
        for piece, swept in zip(part.pieces, tool.swept(meshes(ROBOTIQ), part), strict=True)
        if piece.box is not None
    ]
    (left, right) = (pad.reshape(len(tool.openings), -1, 3) for pad in pads)
    gap = left[..., 1].min(axis=1) - right[..., 1].max(axis=1)
    assert gap[0] == pytest.approx(OPEN, abs=OPENING) and 0 <= gap[-1] < CLOSED
    assert (np.diff(gap) < 0).all()
    extents = np.ptp(left, axis=1)
    np.testing.assert_allclose(extents, np.broadcast_to(extents[0], extents.shape))
    tcp = tool_figures(ROBOTIQ)["tcp"]["value"]
    assert tcp[2] == pytest.approx(left[0, :, 2].mean(), abs=1e-3)


def test_arcs_stay_within_the_sagitta_of_their_chords() -> None:
    """A corner on a turning link, and a corner of a finger carried by the link without turning."""
    corners = np.array([[[0.0, 0.03, 0.04], [0.1, 0.0, 0.02], [0.0, 0.01, 0.0]]])
    hinge = Joint(pin.SE3.Identity(), turn=1.0)
    carried = Joint(pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.06])), turn=-1.0)
    step = 0.1
    for joints, radius in (((hinge,), 0.05), ((hinge, carried), 0.06)):
        piece = Piece(joints)
        first, last, middle = (piece.at(corners, travel) for travel in (0.2, 0.2 + step, 0.25))
        missed = np.linalg.norm(middle - (first + last) / 2, axis=-1).max()
        assert missed == pytest.approx(radius * (1 - np.cos(step / 2)), rel=SERIES)
        assert missed < piece.sagitta(corners, step) < (1 + SERIES) * missed


def test_a_triangle_is_not_held_where_no_cover_holds_its_whole_way() -> None:
    """Two balls side by side contain the first and the last place, but not the way between."""
    triangle = 1e-3 * np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    aside = np.array([0.05, 0.0, 0.0])
    places = np.array([triangle - aside, triangle + aside])
    ends = [np.tile([x, 0.0, 0.0], (2, 1)) for x in (-0.05, 0.05)]
    balls = [LinkCapsule(0, end, 0.02) for end in ends]
    assert not any(len(not_held(place, balls)) for place in places)
    assert len(not_held(between(places), balls))
    assert not len(not_held(between(places), [LinkCapsule(0, np.concatenate(ends)[::2], 0.02)]))


def test_the_hulls_of_overlapping_cells_hold_a_piece() -> None:
    """A 2 cm cube in two cells that overlap by 0.1 mm, and in two cells with a gap."""
    cube = Piece((), box=(0.02, 0.02, 0.02)).triangles(meshes(ROBOTIQ))
    for begin, held in ((-1e-4, True), (1e-3, False)):
        low = FARTHEST[0], (1.0, 1.0, 0.0)
        parts = Part((), (low, ((-1.0, -1.0, begin), FARTHEST[1]))).within(cube)
        assert [each[..., 2].max() for each in parts] == pytest.approx([0.0, 0.01])
        assert [each[..., 2].min() for each in parts] == pytest.approx([-0.01, begin])
        covers = [LinkHull(0, each.reshape(-1, 3), 1e-6) for each in parts]
        assert (len(not_held(cube, covers)) == 0) is held


def test_only_points_below_the_face_of_the_flange_are_on_it() -> None:
    points = np.array([[0.0, 0.03, -1e-3], [0.0, 0.03, 1e-3], [0.0, 0.033, -1e-3]])
    assert on_flange(points).tolist() == [True, False, False]


@pytest.mark.parametrize("every", long_but([7], [1, 7]))
def test_the_hulls_of_the_robotiq_hold_it_at_every_opening_and_in_between(every: int) -> None:
    """The hulls of a part contain its pieces at sampled openings and between neighbouring samples;
    shrunk by 1 mm, every hull misses a point."""
    tool, folder, rest = TOOL_MESHES[ROBOTIQ], meshes(ROBOTIQ), hulls(ROBOTIQ)
    sagitta = tool.sagitta(folder)
    for part in tool.parts:
        covers, rest = rest[: len(part.cells)], rest[len(part.cells) :]
        surfaces = tool.swept(folder, part)
        for surface in surfaces:
            for k in range(0, len(surface), every):
                assert unproven(surface[k : k + 2], covers, sagitta) == 0
        ends = [surface[[0, -1]].reshape(1, -1, 3, 3) for surface in surfaces]
        for each in covers:
            smaller = [replace(c, radius=c.radius - 1e-3 * (c is each)) for c in covers]
            assert any(unproven(end, smaller, 0.0) for end in ends)
    assert not rest


@pytest.mark.long
def test_a_fit_repeats_the_figures() -> None:
    fitted = list(fitted_hulls(ROBOTIQ, meshes(ROBOTIQ)))
    for each, points in zip(hulls(ROBOTIQ), fitted, strict=True):
        np.testing.assert_allclose(each.points, points, atol=HULL_FIT.digit / 2)


@pytest.mark.parametrize("name", [name for name in tool_names() if "hulls" in tool_figures(name)])
def test_the_tcp_lies_within_the_hulls_of_a_tool_that_grips(name: str) -> None:
    assert name in TOOL_MESHES
    tcp = np.array([tool_figures(name)["tcp"]["value"][:3]])
    assert min(from_hull(tcp, each.points)[0] - each.radius for each in hulls(name)) < 0
