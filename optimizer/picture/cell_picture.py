"""Public entry point: `cell_picture(program)` draws an arm in its cell, and the way of its TCP, as
SVG.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from xml.sax.saxutils import escape

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.picture.view import PictureSettings, View
from joulepath.optimizer.problem.arm import PAYLOAD, TOOL, Arm
from joulepath.optimizer.problem.stops import APPROACH, ENTRY, RETREAT

OUTER_ENDS = (APPROACH, RETREAT, ENTRY)
"""How the names of places end that are no stops."""


@dataclass(frozen=True)
class _Drawn:
    """A part of the picture at a depth, the larger the nearer to the viewer."""

    depth: float
    svg: str


def cell_picture(program: Program, settings: PictureSettings | None = None) -> str:
    """Draw the arm at the start and at the first stop, its cell, and the way of its TCP.

    The bodies are taken from the collision model, so the picture shows the checked geometry. The
    way is solid with a payload and dashed without. Stops have numbers; the discs of pick-ups are
    filled.

    Args:
        program: moves and rests, as for exports.
        settings: size, view and colours.

    Returns:
        A stand-alone SVG document.
    """
    asked = settings or PictureSettings()
    first, shown = program.moves[0], _shown(program)
    start = _placed(first.arm, program.start)
    there = _placed(shown.arm, shown.spline.control_points[-1])
    obstacles = _placed_scene(first.arm)
    ways = [(move, _way(move, asked)) for move in program.moves]
    points = np.concatenate(
        [*(way for _, way in ways), *(extent(*each) for each in (*start, *there, *obstacles))]
    )
    ground = _ground(points) if _has_ground(first.arm) else np.zeros((0, 3))
    view = _best_view(np.concatenate([way for _, way in ways]), asked).fitting(
        np.concatenate([points, ground]), asked
    )
    solid = [
        *sorted(
            (
                *(each for body in obstacles for each in _drawn(view, *body, asked)),
                *(each for body in there for each in _drawn(view, *body, asked)),
            ),
            key=lambda each: each.depth,
        ),
    ]
    faint = sorted(
        (each for body in start for each in _drawn(view, *body, asked)), key=lambda each: each.depth
    )
    return _document(
        [
            *([_floor(view, ground)] if len(ground) else ()),
            f'<g opacity="{asked.start}">',
            *(each.svg for each in faint),
            "</g>",
            *(each.svg for each in solid),
            *(_line(view, way, move.arm.payload.mass > 0, asked) for move, way in ways),
            *_marks(view, program, asked),
        ],
        asked,
    )


def _shown(program: Program) -> Move:
    """The move with the drawn end: the first one with a payload, or else the first move."""
    loaded = (move for move in program.moves if move.arm.payload.mass > 0)
    return next(loaded, program.moves[0])


def _way(move: Move, asked: PictureSettings) -> Array:
    """Positions (n, 3) [m] of the TCP."""
    t = np.linspace(0.0, move.duration, asked.points_of_a_move)
    return np.asarray(tcp_pose(move.arm, move.spline.curve(t))[:, :3, 3])


def _placed(arm: Arm, q: Array) -> list[tuple[Body, Array]]:
    """The arm's own bodies with their poses (4, 4) in the base frame at q (nq,) [rad]."""
    model = CollisionModel(arm)
    frames = model.frames(q[None])[0]
    own = {*arm.robot.link_names, TOOL, PAYLOAD}
    return [
        (each, frames[each.link] @ each.T_link_core)
        for each in model.bodies
        if each.name in own and not each.is_hull
    ]


def _placed_scene(arm: Arm) -> list[tuple[Body, Array]]:
    own = {*arm.robot.link_names, TOOL, PAYLOAD}
    return [
        (each, each.T_link_core)
        for each in CollisionModel(arm).bodies
        if each.name not in own and not each.core.is_half_space
    ]


def _has_ground(arm: Arm) -> bool:
    """Whether a half-space lies below the arm."""
    return any(
        each.core.is_half_space and each.T_link_core[2, 2] > 0.9
        for each in CollisionModel(arm).bodies
    )


def _best_view(way: Array, asked: PictureSettings) -> View:
    """The view with the largest projected area of the way."""
    turns = np.linspace(0.0, 2 * np.pi, asked.directions, endpoint=False) + 0.3
    views = [View.at(turn, asked.elevation) for turn in turns]
    return max(views, key=lambda view: float(np.prod(np.ptp(way @ view.axes.T, axis=0) + 1e-6)))


def _drawn(view: View, body: Body, T: Array, asked: PictureSettings) -> Iterator[_Drawn]:
    """The parts of a body: a line as thick as a capsule, or the faces of a solid."""
    points, colour = corners(body, T), _colour(body, asked)
    radius = max(body.core.radius * view.scale, asked.least_radius if body.is_segment else 0.0)
    if body.is_segment:
        ends = view.flat(points[[0, -1]])
        line = "M" + "L".join(_xy(end) for end in ends) + ("h0.01" if len(points) == 1 else "")
        style = 'fill="none" stroke-linecap="round"'
        depth = float((points @ view.towards).mean())
        yield _Drawn(
            depth,
            f'<path d="{line}" {style} stroke="{_shade(colour, 0.62)}" '
            f'stroke-width="{2 * radius + 1.6:.1f}"/>'
            f'<path d="{line}" {style} stroke="{colour}" stroke-width="{2 * radius:.1f}"/>',
        )
        return
    for face, normal in faces(points):
        if normal @ view.towards <= 0 and radius == 0:
            continue
        light = 0.72 + 0.28 * max(float(normal @ np.array([0.2, 0.1, 0.97])), 0.0)
        fill = _shade(colour, light)
        # the many faces of a round body have no edges
        edge = fill if body.core.disc_radius and len(face) == 4 else _shade(colour, light * 0.86)
        shape = "M" + "L".join(_xy(each) for each in view.flat(face)) + "Z"
        yield _Drawn(
            float((face @ view.towards).mean()),
            f'<path d="{shape}" fill="{fill}" stroke="{edge}" '
            f'stroke-width="{max(2 * radius, 0.7):.1f}" stroke-linejoin="round"/>',
        )


def _ground(points: Array) -> Array:
    """Corners (4, 3) [m] of a piece of the ground beneath all points (n, 3) [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    corners = ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))
    return np.array([[x, y, low[2]] for x, y in corners])


def _floor(view: View, corners: Array) -> str:
    shape = "M" + "L".join(_xy(each) for each in view.flat(corners)) + "Z"
    return f'<path d="{shape}" fill="#eef1f4" stroke="#d7dde3"/>'


def _line(view: View, way: Array, loaded: bool, asked: PictureSettings) -> str:
    colour = asked.loaded if loaded else asked.empty
    dash = "" if loaded else ' stroke-dasharray="7 5"'
    path = "M" + "L".join(_xy(each) for each in view.flat(way))
    return (
        f'<path d="{path}" fill="none" stroke="#ffffff" stroke-width="5.5" opacity="0.75"/>'
        f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="3"{dash}/>'
    )


def _marks(view: View, program: Program, asked: PictureSettings) -> Iterator[str]:
    """Marks of the start and of the numbered stops with a rest, or of the goal of a single move."""
    at = tcp_pose(program.moves[0].arm, program.start)[:3, 3]
    yield _label(view.flat(at[None])[0], "Start", asked)
    if len(program.moves) == 1:
        move = program.moves[0]
        end = tcp_pose(move.arm, move.spline.control_points[-1])[:3, 3]
        yield _label(view.flat(end[None])[0], "Goal", asked)
        return
    for each in stops_of(program):
        yield _disc(view.flat(each.place[None])[0], str(each.number), each.takes, asked)


@dataclass(frozen=True)
class RestingStop:
    """A stop: its `number` from 1, when the arm comes to it, `t` [s], and `place` (3,) [m] of the
    TCP; `takes`: a part is taken up there."""

    number: int
    t: float
    place: Array
    takes: bool


def stops_of(program: Program) -> Iterator[RestingStop]:
    """The stops of a program. The end of its last move is none: a cycle leads back to the start.
    Nor are the outer ends of lines, and the starts of paths.
    """
    moves = [k for k, each in enumerate(program.timed) if isinstance(each.step, Move)]
    number = 0
    for here, following in pairwise(moves):
        timed, move = program.timed[here], program.timed[here].step
        assert isinstance(move, Move)
        if move.label.endswith(OUTER_ENDS):
            continue
        number += 1
        place = tcp_pose(move.arm, move.spline.control_points[-1])[:3, 3]
        takes = any(each.grasps for each in program.timed[here + 1 : following + 1])
        yield RestingStop(number, timed.t0 + move.duration, place, takes)


def _label(at: Array, text: str, asked: PictureSettings) -> str:
    width = 15 + 8.2 * len(text)
    x = min(max(float(at[0]) - width / 2, 4.0), asked.width - width - 4)
    y = min(float(at[1]) + 12, asked.height - 28)
    return (
        f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="4.5" fill="{asked.empty}" stroke="#fff"/>'
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="23" rx="5" fill="#ffffff" '
        f'stroke="#c9d1d9"/><text x="{x + width / 2:.1f}" y="{y + 16:.1f}" font-size="14" '
        f'text-anchor="middle" fill="{asked.empty}">{escape(text)}</text>'
    )


def _disc(at: Array, text: str, filled: bool, asked: PictureSettings) -> str:
    fill, ink = (asked.loaded, "#ffffff") if filled else ("#ffffff", asked.ink)
    return (
        f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="12" fill="{fill}" '
        f'stroke="{asked.ink if not filled else "#ffffff"}" stroke-width="1.4"/>'
        f'<text x="{at[0]:.1f}" y="{at[1] + 4.8:.1f}" font-size="13.5" text-anchor="middle" '
        f'fill="{ink}">{escape(text)}</text>'
    )


def _colour(body: Body, asked: PictureSettings) -> str:
    if body.name == PAYLOAD:
        return asked.payload
    if body.name == TOOL:
        return asked.tool
    return asked.arm if body.link or body.core.radius else asked.obstacle


def _shade(colour: str, factor: float) -> str:
    parts = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{min(round(part * factor), 255):02x}" for part in parts)


def _xy(at: Array) -> str:
    return f"{at[0]:.1f} {at[1]:.1f}"


def _document(parts: Sequence[str], asked: PictureSettings) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {asked.width} {asked.height}" '
        'font-family="Inter, DejaVu Sans, sans-serif">' + "".join(parts) + "</svg>"
    )


def corners(body: Body, T: Array) -> Array:
    """Points (n, 3) [m] whose hull, grown by the body's radius, is the body."""
    core = body.core
    points = core.points
    if core.disc_radius:
        angle = np.linspace(0.0, 2 * np.pi, PictureSettings.discs, endpoint=False)
        disc = core.disc_radius * np.stack(
            [np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1
        )
        points = (points[:, None] + disc).reshape(-1, 3)
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])


def extent(body: Body, T: Array) -> Array:
    """Points (n, 3) [m] around the body, its radius included."""
    directions = 1.2 * body.core.radius * np.concatenate([np.eye(3), -np.eye(3)])
    return np.asarray((corners(body, T)[:, None] + directions).reshape(-1, 3))


def faces(points: Array) -> Iterator[tuple[Array, Array]]:
    """The flat faces of a hull: their corners (m, 3) in order, and outward normals (3,)."""
    try:
        hull = ConvexHull(points)
    except QhullError:
        # a plate without a thickness
        middle = points.mean(axis=0)
        normal = np.linalg.svd(points - middle)[2][-1]
        yield _around(points, normal), normal
        yield _around(points, -normal), -normal
        return
    planes = np.round(hull.equations, 6)
    for plane in np.unique(planes, axis=0):
        corners = np.unique(hull.simplices[(planes == plane).all(axis=1)])
        yield _around(points[corners], plane[:3]), plane[:3]


def _around(points: Array, normal: Array) -> Array:
    """Points of a plane in order around their middle."""
    off = points - points.mean(axis=0)
    first = off[int(np.argmax((off**2).sum(axis=1)))]
    angle = np.arctan2(off @ np.cross(normal, first), off @ first)
    return np.asarray(points[np.argsort(angle)])
