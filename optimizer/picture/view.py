"""How a cell is looked at: size and colours of its picture, and the projection of points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array


@dataclass(frozen=True)
class PictureSettings:
    """Size, view and colours of a picture."""

    width: int = 760
    height: int = 560
    border: int = 34
    """Free space around what is drawn [px]."""
    elevation: float = 0.45
    """Angle of the view above the horizon [rad]."""
    directions: int = 12
    """Directions around the arm of which the one is taken that shows most of the way."""
    points_of_a_move: int = 60
    discs: int = 28
    """Corners of the polygon that stands for a disc."""
    least_radius: float = 4.0
    """Half of the least width of a body [px]."""
    arm: str = "#c3ccd5"
    tool: str = "#6f8aa5"
    payload: str = "#e08e2b"
    obstacle: str = "#d3ab82"
    loaded: str = "#14654f"
    empty: str = "#2f6fb3"
    ink: str = "#17202b"
    start: float = 0.35
    """Opacity of the arm at the start."""


@dataclass(frozen=True)
class View:
    """Orthographic projection: `axes` (2, 3) of the picture and `towards` (3,) the viewer."""

    axes: Array
    towards: Array
    scale: float = 1.0
    offset: tuple[float, float] = (0.0, 0.0)

    @staticmethod
    def at(azimuth: float, elevation: float) -> View:
        """From a direction around the arm and an angle above the horizon [rad]."""
        c, s, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
        # y of a picture points down
        axes = np.array([[-s, c, 0.0], [se * c, se * s, -ce]])
        return View(axes, np.array([ce * c, ce * s, se]))

    def flat(self, points: Array) -> Array:
        """Points (n, 2) [px] of points (n, 3) [m]."""
        return np.asarray(points @ self.axes.T * self.scale + self.offset)

    def fitting(self, points: Array, asked: PictureSettings) -> View:
        """The same view, in which all points (n, 3) [m] are within the picture."""
        flat = points @ self.axes.T
        low, size = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-3)
        room = np.array([asked.width, asked.height]) - 2 * asked.border
        scale = float((room / size).min())
        offset = asked.border + (room - size * scale) / 2 - low * scale
        return View(self.axes, self.towards, scale, (float(offset[0]), float(offset[1])))
