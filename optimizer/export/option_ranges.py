"""Ranges of the options of all formats."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OptionRanges:
    """Smallest and largest values of numbers, and patterns of texts."""

    period: tuple[float, float] = (1e-4, 1.0)
    """Time between two rows [s]."""
    lookahead_time: tuple[float, float] = (0.03, 0.2)
    """Parameter of servoj [s], from its documentation."""
    gain: tuple[float, float] = (100.0, 2000.0)
    """Parameter of servoj, from its documentation."""
    standard_output: tuple[int, int] = (0, 7)
    """Standard digital output of Universal Robots."""
    tolerance: tuple[float, float] = (1e-4, 0.1)
    """Deviation of points from the spline [rad]."""
    offset: tuple[float, float] = (-360.0, 360.0)
    """Offset of an axis [degrees]."""
    krl_output: tuple[int, int] = (1, 4096)
    """Output of a KUKA controller."""
    prefix: str = r"[A-Za-z0-9_/.-]{0,64}"
    """Prefix of names of joints: characters of names in ROS."""
    controller: str = r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*"
    """Name of a node in ROS."""
    signal: str = r"[A-Za-z][A-Za-z0-9_]{0,31}"
    """Name of a signal in RAPID."""


OPTION_RANGES = OptionRanges()
