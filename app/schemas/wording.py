"""Descriptions that fields of several answers share."""

from __future__ import annotations

BODIES = "Names of the two bodies: links, `tool`, `payload` or obstacles."
LOWER_BOUND = (
    "Lower bound of the objective: no motion of any shape and any allowed duration between these targets needs less."
)
GAP = "1 - lower_bound / energy of the objective; 0 if this energy is not positive."
WARNINGS = (
    "Remarks on the motion, in words; empty if there are none. If two bodies come closer than 2 mm, one names them, "
    "their distance without margins, and the time. Others say that arm configurations may have been missed, that a "
    "baseline is left out, or what a tool or payload without a shape would touch."
)
OBJECTIVE = "Energy that was minimised: electrical energy drawn from the supply, or mechanical work."
