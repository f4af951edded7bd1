"""Descriptions that fields of several answers share."""

from __future__ import annotations

WARNINGS = (
    "Remarks on the motion, in words; empty if there are none. If two bodies come closer than 2 mm, one names them, "
    "their distance without margins, and the time. Others say that arm configurations may have been missed, that a "
    "baseline is left out, or what a tool or payload without a shape would touch."
)
