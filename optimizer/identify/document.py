"""Identified figures in the form of a robot's `figures.yaml`.

A figure has a value, unit, source, trust letter and standard deviation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.fits.whole_fit import LINK_NAMES
from joulepath.optimizer.identify.results import IdentifiedFigures

FRICTION_LAW = "identified"
_LAW_UNITS = {
    "coulomb": "N·m",
    "curved": "N·m",
    "speed": "rad/s",
    "viscous": "N·m·s/rad",
    "load": "1",
}
_DRIVES = {
    "torque_constant": "N·m/A",
    "rotor_inertia": "kg·m²",
    "copper": "W/A²",
    "inverter_linear": "W/A",
}
_INERTIALS = {"mass": "kg", "center_of_mass": "m", "inertia": "kg·m²"}
TRUST = "B"
LINK_MASS = "inertials.m"


def document_of(figures: IdentifiedFigures, date: str) -> dict[str, Any]:
    """Document of identified figures, with their covariance.

    Sections without identified figures are left out. Names in the covariance are paths of figures
    with the number of the joint: `drives.copper.2`.

    Args:
        figures: the figures.
        date: date of the sources of the figures.
    """
    source = f"identified from logs {', '.join(figures.logs)}, {date}"

    def figure(name: str, unit: str) -> dict[str, Any]:
        value = figures.values[name]
        content = {"value": value.tolist(), "unit": unit, "source": source, "trust": TRUST}
        deviations = _deviations(figures, name, value)
        return content if deviations is None else content | {"sd": deviations.tolist()}

    def section(units: dict[str, str]) -> dict[str, Any]:
        return {name: figure(name, unit) for name, unit in units.items() if name in figures.values}

    law, drives, inertials = section(_LAW_UNITS), section(_DRIVES), section(_INERTIALS)
    document: dict[str, Any] = {"robot": figures.robot}
    if law:
        document["friction_laws"] = {FRICTION_LAW: law}
    if drives:
        document["drives"] = drives
    if "idle_power" in figures.values:
        document["electronics"] = {"idle_power": figure("idle_power", "W")}
    if inertials:
        turned = {"value": np.zeros((len(figures.values["mass"]), 3)).tolist(), "unit": "rad"}
        document["inertials"] = inertials | {
            "inertia_frame_rpy": turned | {"source": source, "trust": TRUST}
        }
    listed = [k for k, (name, _) in enumerate(figures.parameters) if _path(name) is not None]
    if listed:
        document["covariance"] = {
            "names": [_path(*figures.parameters[k]) for k in listed],
            "matrix": _symmetric(figures.covariance[np.ix_(listed, listed)]).tolist(),
        }
    return document | {"session_sd": figures.session_sd, "move_sd": figures.move_sd}


def _deviations(figures: IdentifiedFigures, name: str, value: Array) -> Array | None:
    """Standard deviations in the shape of a figure, 0 for joints with the robot's own value; None
    if no joint has a standard deviation.
    """
    found, known = np.zeros(value.shape), False
    for (figure, joint), sd in zip(figures.parameters, figures.sd.tolist(), strict=True):
        if figure == (LINK_MASS if name == "mass" else name):
            known = True
            found[() if joint is None else joint] = sd
    return found if known else None


def _path(name: str, joint: int | None = None) -> str | None:
    """Path of a figure in a document; None for a figure without a path."""
    end = "" if joint is None else f".{joint}"
    if name in _LAW_UNITS:
        return f"friction_laws.{FRICTION_LAW}.{name}{end}"
    if name in _DRIVES:
        return f"drives.{name}{end}"
    if name in LINK_NAMES:
        return f"{name}{end}"
    return "electronics.idle_power" if name == "idle_power" else None


def _symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2
