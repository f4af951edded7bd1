"""Appearance of an arm from its figures: tubes between joints, round housings with caps at
joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array

Kind = Literal["housing", "cap", "ring", "tube", "foot"]


@dataclass(frozen=True)
class FormSettings:
    """Proportions of the drawing."""

    samples: int = 9
    """Sampled points of a capsule's axis."""
    housing_distance: float = 0.7
    """Largest distance of a capsule's axis from a joint axis, over its radius, at the joint's
    housing."""
    slimming: float = 0.94
    """Radius of a body over the radius of the capsule around it."""
    upright: float = 0.99
    """Least vertical component of the first joint axis of an upright arm."""
    foot_height: float = 0.02
    """Height of the foot [m]."""
    foot_width: float = 1.22
    """Radius of the foot over the radius of the first housing."""


FORM = FormSettings()


@dataclass(frozen=True)
class RoundBody:
    """A round body about the line from `start` to `end` [m] in the link frame, with radius [m]."""

    kind: Kind
    start: list[float]
    end: list[float]
    radius: float


@dataclass
class _Housing:
    """Part of a link about a joint axis, the z axis of `T` (4, 4), from `low` to `high` [m]."""

    T: Array
    low: float
    high: float
    radius: float

    def at(self, height: float) -> Array:
        """The point (3,) of the axis at a height."""
        return np.asarray(self.T[:3, 3] + height * self.T[:3, 2])

    @property
    def middle(self) -> Array:
        """Its centre (3,)."""
        return self.at((self.low + self.high) / 2)

    def body(self, low: float, high: float, radius: float, kind: Kind) -> RoundBody:
        """A body about its axis."""
        return RoundBody(kind, self.at(low).tolist(), self.at(high).tolist(), radius)


def link_bodies(figures: dict[str, Any]) -> list[list[RoundBody]]:
    """The bodies of every link by a robot's figures, base first."""
    kinematics = figures["kinematics"]
    names = ["base", *kinematics["link_names"]["value"]]
    capsules = [
        np.reshape(figures["collision"].get(name, {}).get("value", []), (-1, 7)) for name in names
    ]
    placements = [_placement(row) for row in kinematics["joint_origin"]["value"]]
    typical = max(float(np.linalg.norm(T[:3, 3])) for T in placements) / 8
    # housings of both links at every joint, about the same axis and with the same origin
    pairs = [
        (_housing(capsules[joint], T, typical), _housing(capsules[joint + 1], np.eye(4), typical))
        for joint, T in enumerate(placements)
    ]
    for pair in pairs:
        _meet(*pair)
    _ground(placements[0], pairs[0][0])
    bodies: list[list[RoundBody]] = [[] for _ in names]
    for joint, (first, second) in enumerate(pairs):
        bodies[joint] += [*_bodies(first, second), _ring(first, second)]
        bodies[joint + 1] += _bodies(second, first)
    flange = _placement(kinematics["flange_origin"]["value"])[:3, 3]
    for link, own in enumerate(capsules):
        foot, last = (np.zeros(3), pairs[0][0].radius), (flange, 0.8 * pairs[-1][1].radius)
        begin = (pairs[link - 1][1].middle, pairs[link - 1][1].radius) if link else foot
        end = (pairs[link][0].middle, pairs[link][0].radius) if link < len(pairs) else last
        bodies[link] += _tube(own, *begin, *end, is_base=link == 0)
    bodies[0].append(
        RoundBody(
            "foot", [0.0] * 3, [0.0, 0.0, FORM.foot_height], FORM.foot_width * pairs[0][0].radius
        )
    )
    return bodies


def _placement(origin: list[float]) -> Array:
    """The matrix (4, 4) of x, y, z [m], roll, pitch, yaw [rad]."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = pin.rpy.rpyToMatrix(*origin[3:]), origin[:3]
    return T


def _housing(capsules: Array, T: Array, typical: float) -> _Housing:
    """The housing formed by a link's capsules (n, 7) about the z axis of T.

    Without capsules at this axis, its size follows from the `typical` length [m].
    """
    start, end, radius = capsules[:, :3], capsules[:, 3:6], np.repeat(capsules[:, 6], FORM.samples)
    share = np.linspace(0, 1, FORM.samples)[:, None]
    points = (start[:, None] + share * (end - start)[:, None]).reshape(-1, 3) - T[:3, 3]
    along = points @ T[:3, 2]
    aside = np.linalg.norm(points - along[:, None] * T[:3, 2], axis=1)
    near = aside <= FORM.housing_distance * radius
    if not near.any():
        small = min(0.7 * float(radius[aside.argmin()]), typical) if len(radius) else typical / 2
        return _Housing(T, -small, small, small)
    along, aside, radius = along[near], aside[near], radius[near]
    wide = FORM.slimming * np.sqrt(np.maximum(radius**2 - aside**2, 0.4 * radius**2))
    return _Housing(
        T,
        float((along - 0.8 * radius).min()),
        float((along + 0.8 * radius).max()),
        float(wide.max()),
    )


def _meet(first: _Housing, second: _Housing) -> None:
    """Trim the two housings of a joint to a common border."""
    lower, upper = (
        (first, second) if first.low + first.high < second.low + second.high else (second, first)
    )
    border = min((lower.high + upper.low) / 2, upper.high - 0.3 * upper.radius)
    lower.high = upper.low = max(lower.low + 0.3 * lower.radius, border)
    slim = min(lower.radius, upper.radius)
    lower.radius, upper.radius = min(lower.radius, 1.3 * slim), min(upper.radius, 1.3 * slim)


def _ground(placement: Array, foot: _Housing) -> None:
    """Trim the base at the ground."""
    up, height = placement[2, 2], placement[2, 3]
    if up > FORM.upright:
        foot.low = max(foot.low, -height)
    if up < -FORM.upright:
        foot.high = min(foot.high, height)


def _bodies(own: _Housing, other: _Housing) -> list[RoundBody]:
    """A housing with a cap on its outer side."""
    outward = -1 if own.low + own.high < other.low + other.high else 1
    inner, outer = (own.low, own.high) if outward > 0 else (own.high, own.low)
    edge = outer - outward * 0.16 * own.radius
    return [
        own.body(inner, edge, own.radius, "housing"),
        own.body(edge, outer, 0.9 * own.radius, "cap"),
    ]


def _ring(own: _Housing, other: _Housing) -> RoundBody:
    """The gap between the housings of a joint."""
    inner = own.high if own.low + own.high < other.low + other.high else own.low
    gap = 0.035 * own.radius
    return own.body(inner - gap, inner + gap, 1.015 * min(own.radius, other.radius), "ring")


def _tube(
    capsules: Array, start: Array, start_radius: float, end: Array, end_radius: float, is_base: bool
) -> list[RoundBody]:
    """The tube between the ends of a link, as thick as its long capsules (n, 7).

    Overlapping ends need no tube.
    """
    span = float(np.linalg.norm(end - start))
    if span < 0.35 * (start_radius + end_radius):
        return []
    lengths = np.linalg.norm(capsules[:, 3:6] - capsules[:, :3], axis=1)
    long = capsules[lengths > 0.4 * span, 6]
    widest = 0.92 * min(start_radius, end_radius)
    slim = min(widest, FORM.slimming * float(long.max()) if len(long) else 0.8 * widest)
    return [RoundBody("tube", start.tolist(), end.tolist(), widest if is_base else slim)]
