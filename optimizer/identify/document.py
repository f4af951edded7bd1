"""Identified figures in the form of a robot's `figures.yaml`.

A figure has a value, unit, source, trust letter and standard deviation. Unidentified figures keep
the robot's own value, source and letter. Some figures of the power are determined only in
combination: they take their fitted values but keep the robot's own letter. A figure of several
joints has the worst letter of its joints.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from joulepath.models.robot import Array
from joulepath.models.trust import TRUST
from joulepath.models.uncertainty.document import DOCUMENT, TOP, covariance_of
from joulepath.optimizer.identify.fits.whole_fit import LINK_NAMES
from joulepath.optimizer.identify.logs.log_warnings import named_joints
from joulepath.optimizer.identify.results import IdentifiedFigures

FRICTION_LAW = "identified"
_LAW_UNITS = {
    "coulomb": "N·m",
    "curved": "N·m",
    "speed": "rad/s",
    "viscous": "N·m·s/rad",
    "load": "1",
    "knee": "rad/s",
}
_DRIVES = {
    "torque_constant": "N·m/A",
    "rotor_inertia": "kg·m²",
    "copper": "W/A²",
    "inverter_constant": "W",
    "inverter_linear": "W/A",
    "inverter_quadratic": "W/A²",
}
_INERTIALS = {"mass": "kg", "center_of_mass": "m", "inertia": "kg·m²"}
IDENTIFIED = "B"
LINK_MASS = "inertials.m"
UNDETERMINED = (
    "The logs hardly determine {}: undetermined values are the most probable ones, given the "
    "logs and the range of the robot's own."
)
KEPT = "Of {}, the robot's own values of trust {} are kept: {}"


def document_of(
    own: Mapping[str, Any], law: str, figures: IdentifiedFigures, date: str
) -> dict[str, Any]:
    """Document of identified figures, with their covariance.

    Sections without identified figures are left out. Names in the covariance are paths of figures
    with the number of the joint: `drives.copper.2`.

    Args:
        own: the robot's own figures by section.
        law: name of the robot's own friction law.
        figures: the figures.
        date: date of the sources of the figures.
    """
    source = f"identified from logs {', '.join(figures.logs)}, {date}"

    def section(units: dict[str, str], known: Mapping[str, Any]) -> dict[str, Any]:
        return {
            name: _figure(figures, name, unit, source, known.get(name))
            for name, unit in units.items()
            if name in figures.values
        }

    own_law = own["friction_laws"][law]
    without_load = {"value": np.zeros(len(figures.session_sd)).tolist(), "unit": "1"}
    without_load |= {name: own_law["coulomb"][name] for name in ("source", "trust")}
    friction = section(_LAW_UNITS, {"load": without_load} | own_law)
    drives = section(_DRIVES, own["drives"])
    electronics = section({"idle_power": "W"}, own["electronics"])
    inertials = section(_INERTIALS, own["inertials"])
    # figures from earlier logs differ from the figures of the bundled robot
    earlier = own if own.keys() & TOP else {}
    document: dict[str, Any] = {"robot": figures.robot}
    document |= {name: earlier[name] for name in ("inertials", "mains") if name in earlier}
    if friction or earlier:
        document["friction_laws"] = {FRICTION_LAW: friction or own_law}
    for name, found in (("drives", drives), ("electronics", electronics)):
        if found or earlier:
            document[name] = {**earlier.get(name, {}), **found}
    if inertials:
        turned = {"value": np.zeros((len(figures.values["mass"]), 3)).tolist(), "unit": "rad"}
        document["inertials"] = inertials | {
            "inertia_frame_rpy": turned | {"source": source, "trust": inertials["mass"]["trust"]}
        }
    paths = {k: path for k, each in enumerate(figures.parameters) if (path := _path(*each))}
    kept, earlier_covariance = _kept(own, law, document, paths.values())
    if paths or kept:
        at = np.ix_([*paths], [*paths])
        document["covariance"] = {
            "names": [*paths.values(), *kept],
            "matrix": block_diag(_symmetric(figures.covariance[at]), earlier_covariance).tolist(),
        }
    return document | {"session_sd": figures.session_sd.tolist(), "move_sd": figures.move_sd}


def _kept(
    own: Mapping[str, Any], law: str, document: Mapping[str, Any], found: Collection[str]
) -> tuple[list[str], Array]:
    """Paths and covariance of the figures kept from earlier logs.

    Args:
        own: the robot's own figures by section.
        law: name of the robot's own friction law.
        document: the document without its covariance.
        found: paths of the figures from the logs of the document.
    """
    known = covariance_of(own)
    if known is None:
        return [], np.zeros((0, 0))
    before, now = f"friction_laws.{law}.", f"friction_laws.{FRICTION_LAW}."
    paths = [
        now + each.removeprefix(before) if each.startswith(before) else each for each in known.names
    ]
    kept = [
        k
        for k, path in enumerate(paths)
        if path not in found
        and known.place_of(known.names[k], law) is not None
        and _entry(document, path) == _entry(own, known.names[k])
    ]
    return [paths[k] for k in kept], known.matrix[np.ix_(kept, kept)]


def _entry(figures: Mapping[str, Any], path: str) -> Any:
    """The value at a path; for links the whole section, as its parameters are interdependent."""
    section, *parts = path.split(".")
    node: Any = figures.get(section, {})
    if section == "inertials":
        return node
    for part in parts[: 2 if section == "friction_laws" else 1]:
        node = node.get(part, {})
    value = node.get("value")
    return value if value is None or len(parts) == 1 else value[int(parts[-1])]


def _figure(
    figures: IdentifiedFigures, name: str, unit: str, source: str, own: dict[str, Any] | None
) -> dict[str, Any]:
    """One figure; the robot's `own` one if no joint differs from it."""
    value, identified = figures.values[name], figures.identified[name]
    changed = identified
    if own is not None:
        differs = value != np.asarray(own["value"], dtype=float)
        changed = identified | (differs.any(axis=1) if differs.ndim > 1 else differs)
        if not np.any(changed):
            return own
    letters = [IDENTIFIED] * bool(np.any(identified))
    notes = list[str]()
    if own is not None and not np.all(identified):
        letters.append(own["trust"])
        for joints, text in ((changed & ~identified, UNDETERMINED), (~changed, KEPT)):
            if np.any(joints):
                which = "this figure"
                if np.ndim(joints):
                    which = named_joints(np.flatnonzero(joints).tolist())
                notes.append(text.format(which, own["trust"], own["source"]))
    content: dict[str, Any] = {
        "value": value.tolist(),
        "unit": unit,
        "source": source,
        "trust": max(letters or [IDENTIFIED], key=list(TRUST).index),
    }
    if notes:
        content["note"] = " ".join(notes)[: DOCUMENT.text]
    deviations = _deviations(figures, name, value, own or {})
    return content if deviations is None else content | {"sd": deviations.tolist()}


def _deviations(
    figures: IdentifiedFigures, name: str, value: Array, own: Mapping[str, Any]
) -> Array | None:
    """Standard deviations in the shape of a figure; None if all are 0.

    A joint with the robot's own value keeps its standard deviation from earlier logs, otherwise 0.
    """
    found = np.zeros(value.shape)
    if "sd" in own:
        found = np.where(value == np.asarray(own["value"]), np.asarray(own["sd"]), found)
    for (figure, joint), sd in zip(figures.parameters, figures.sd.tolist(), strict=True):
        if figure == (LINK_MASS if name == "mass" else name):
            found[() if joint is None else joint] = sd
    return found if found.any() else None


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
