"""Documents of figures identified on one arm, with their covariance.

A document has the form of the robot's `figures.yaml`; `robot` is the name of the robot. An
identified figure has `sd` beside its value. At the top level, `covariance` has the names and the
matrix of all identified parameters, `session_sd` [1] is the relative deviation of friction from day
to day, of all joints together or of each by itself, and `move_sd` [W] the mean power of model
errors in a motion. Only the figures in `REPLACEABLE` may differ from the robot's own figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from joulepath.models.arrays import read_only
from joulepath.models.robot import Array
from joulepath.models.uncertainty.parameters import BASE_POWER, DRIVES, FRICTION, LINKS

TOP = ("covariance", "session_sd", "move_sd")
# least and greatest value of the parts of a friction law
LAW: dict[str, tuple[float, float]] = {
    "coulomb": (0.0, 1e5),
    "curved": (0.0, 1e5),
    "speed": (1e-6, 1e5),
    "viscous": (0.0, 1e5),
    "load": (0.0, 0.999),
    "knee": (1e-6, 1.0),
}
OPTIONAL = frozenset({"load", "knee"})
"""Parts of a friction law that may be left out; the knee is one number for all joints."""
REPLACEABLE: dict[str, dict[str, tuple[float, float]]] = {
    "drives": {
        "torque_constant": (1e-6, 1e6),
        "rotor_inertia": (0.0, 1e5),
        "copper": (0.0, 1e6),
        "inverter_constant": (0.0, 1e3),
        "inverter_linear": (0.0, 1e3),
        "inverter_quadratic": (0.0, 1e3),
    },
    "electronics": {
        "idle_power": (0.0, 1e5),
        "controller_power": (0.0, 1e5),
        "regeneration": (0.0, 1.0),
    },
    "mains": {"factor": (1.0, 10.0), "constant": (0.0, 1e5)},
    "inertials": {
        "mass": (1e-6, 1e5),
        "center_of_mass": (-1e3, 1e3),
        "inertia_frame_rpy": (-10.0, 10.0),
        "inertia": (-1e6, 1e6),
    },
}
_WIDTHS = {"center_of_mass": 3, "inertia_frame_rpy": 3, "inertia": 6}
_WORDS = ("unit", "source", "trust", "note")


@dataclass(frozen=True)
class DocumentLimits:
    """Ceilings and tolerances of a document."""

    laws: int = 8
    """Friction laws."""
    text: int = 2000
    """Characters of a unit, source or note."""
    parameters: int = 200
    """Parameters of the covariance."""
    variance: float = 1e12
    """Largest entry of the covariance."""
    rounded: float = 1e-3
    """Relative violation of the triangle inequality of principal moments due to rounding."""


DOCUMENT = DocumentLimits()


class InvalidFigures(ValueError):
    """An invalid document of figures; `field` is the place of the error."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}" if field else message)
        self.field = field


@dataclass(frozen=True)
class Covariance:
    """Covariance `matrix` (n, n) of the identified parameters.

    A name is the path of a figure, with the index of the joint for figures of joints:
    `friction_laws.identified.coulomb.0`, `electronics.idle_power`. Links have the parameters in
    which torques are linear: `inertials.mx.1`.
    """

    names: tuple[str, ...]
    matrix: Array
    session_sd: Array
    """Of all joints together (), or of each joint independently (nq,)."""
    move_sd: float

    def place_of(self, name: str, law: str) -> tuple[str, int] | None:
        """Figure of `parameters` and joint of a name; None for another friction law."""
        parts = name.split(".")
        if parts[0] == "electronics":
            return BASE_POWER, 0
        if parts[0] == "friction_laws" and parts[1] != law:
            return None
        return parts[-2], int(parts[-1])

    def places(self, law: str) -> list[tuple[str, int]]:
        """Figures and joints of all names, with the friction law `law`."""
        return [found for name in self.names if (found := self.place_of(name, law)) is not None]


def covariance_of(figures: Mapping[str, Any]) -> Covariance | None:
    """The covariance of a robot's figures; None without identified figures."""
    if "covariance" not in figures:
        return None
    given = figures["covariance"]
    return Covariance(
        tuple(given["names"]),
        np.array(given["matrix"], dtype=float),
        np.array(figures.get("session_sd", 0.0), dtype=float),
        float(figures.get("move_sd", 0.0)),
    )


def replaced_in(robot: str, figures: dict[str, Any], document: Any) -> dict[str, Any]:
    """Validated sections, figures and covariance with which a document replaces the robot's own.

    Args:
        robot: name of the robot.
        figures: the robot's own figures.
        document: the document of the user.

    Raises:
        InvalidFigures: the document is invalid; the error names the place.
    """
    if not isinstance(document, dict):
        raise InvalidFigures("", "Figures must be a mapping of sections.")
    if document.get("robot", robot) != robot:
        raise InvalidFigures("robot", f"names another robot than {robot}.")
    nq = len(figures["drives"]["copper"]["value"])
    replaced: dict[str, Any] = {}
    for section, content in document.items():
        if section in TOP or section == "robot" or content == figures.get(section):
            continue
        if section == "friction_laws":
            replaced[section] = _laws(figures[section], content, nq)
        elif section in REPLACEABLE:
            changed = _section(section, figures.get(section, {}), content, nq)
            if changed:
                replaced[section] = changed
        else:
            raise InvalidFigures(
                section,
                "differs from the robot's own. Identified figures may replace only friction_laws, "
                f"{', '.join(REPLACEABLE)}.",
            )
    whole = merged(figures, replaced)
    if set(whole.get("mains", {})) not in (set(), set(REPLACEABLE["mains"])):
        raise InvalidFigures("mains", "must have both figures, factor and constant.")
    if "inertials" in replaced:
        _check_bodies(whole["inertials"])
    return replaced | _uncertainty(document, whole, nq)


def with_document(robot: str, figures: dict[str, Any], document: Any) -> dict[str, Any]:
    """The robot's figures, updated by a document. Raises InvalidFigures."""
    return merged(figures, replaced_in(robot, figures, document))


def merged(figures: dict[str, Any], replaced: dict[str, Any]) -> dict[str, Any]:
    """The robot's figures, updated by the result of `replaced_in`."""
    result = dict(figures)
    for section, content in replaced.items():
        if section in TOP:
            result[section] = content
        elif section == "friction_laws":
            # The first law is the default: laws of the document come first.
            result[section] = content | {
                n: law for n, law in figures[section].items() if n not in content
            }
        else:
            result[section] = figures.get(section, {}) | content
    return result


def _laws(own: dict[str, Any], content: Any, nq: int) -> dict[str, Any]:
    if not isinstance(content, dict) or not 0 < len(content) <= DOCUMENT.laws:
        raise InvalidFigures(
            "friction_laws", f"must be a mapping of 1 to {DOCUMENT.laws} laws by name."
        )
    laws = {}
    for name, law in content.items():
        if not isinstance(name, str) or not name.isidentifier() or len(name) > 64:
            raise InvalidFigures(
                "friction_laws", "Names of laws are letters, digits and underscores, at most 64."
            )
        if law == own.get(name):
            continue
        where = f"friction_laws.{name}"
        if not isinstance(law, dict) or not set(LAW) - OPTIONAL <= set(law) <= set(LAW):
            raise InvalidFigures(
                where,
                f"must have the figures {', '.join(LAW)}, of which "
                f"{' and '.join(sorted(OPTIONAL))} may be left out.",
            )
        laws[name] = {
            part: _figure(f"{where}.{part}", law[part], LAW[part], () if part == "knee" else (nq,))
            for part in LAW
            if part in law
        }
    return laws


def _section(section: str, own: dict[str, Any], content: Any, nq: int) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise InvalidFigures(section, "must be a mapping of figures.")
    changed = {}
    for name, figure in content.items():
        if figure == own.get(name):
            continue
        where = f"{section}.{name}"
        if name not in REPLACEABLE[section]:
            raise InvalidFigures(where, "differs from the robot's own and cannot be identified.")
        shape = (
            ()
            if section in ("electronics", "mains")
            else (nq, _WIDTHS[name])
            if name in _WIDTHS
            else (nq,)
        )
        changed[name] = _figure(where, figure, REPLACEABLE[section][name], shape)
    return changed


def _figure(
    where: str, figure: Any, allowed: tuple[float, float], shape: tuple[int, ...]
) -> dict[str, Any]:
    """The validated figure with its known fields. Raises InvalidFigures."""
    if not isinstance(figure, dict) or not {"value", "unit", "source", "trust"} <= set(figure):
        raise InvalidFigures(where, "must have value, unit, source and trust.")
    if unknown := set(figure) - {"value", "sd", *_WORDS}:
        raise InvalidFigures(
            where, f"has fields that no figure has: {', '.join(sorted(map(str, unknown)))[:200]}."
        )
    for word in _WORDS:
        if word in figure and (
            not isinstance(figure[word], str) or len(figure[word]) > DOCUMENT.text
        ):
            raise InvalidFigures(
                f"{where}.{word}", f"must be a text of at most {DOCUMENT.text} characters."
            )
    if figure["trust"] not in ("A", "B", "C", "T", "E"):
        raise InvalidFigures(f"{where}.trust", "must be one of A, B, C, T, E.")
    result = {name: figure[name] for name in _WORDS if name in figure}
    low, high = allowed
    for part, least, most in (("value", low, high), ("sd", 0.0, 1e6)):
        if part == "sd" and figure.get("sd") is None:
            continue
        value = numbers(f"{where}.{part}", figure[part], shape)
        if not ((value >= least) & (value <= most)).all():
            raise InvalidFigures(f"{where}.{part}", f"must be from {least:g} to {most:g}.")
        result[part] = value.tolist()
    return result


def numbers(where: str, value: Any, shape: tuple[int, ...]) -> Array:
    """A checked array. Raises InvalidFigures."""
    try:
        return read_only(value, shape, "It")
    except (ValueError, OverflowError) as error:
        raise InvalidFigures(where, str(error)) from None


def _check_bodies(inertials: dict[str, Any]) -> None:
    """Raises InvalidFigures for a physically impossible inertia."""
    for k, row in enumerate(inertials["inertia"]["value"]):
        ixx, ixy, ixz, iyy, iyz, izz = row
        moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
        slack = DOCUMENT.rounded * abs(float(moments[-1]))
        if moments[0] < -slack or moments[2] > moments[0] + moments[1] + slack:
            raise InvalidFigures(
                f"inertials.inertia.{k}",
                "is impossible for a real body: check its principal moments.",
            )


def _uncertainty(document: dict[str, Any], figures: dict[str, Any], nq: int) -> dict[str, Any]:
    """The validated fields of `TOP` in the document."""
    result: dict[str, Any] = {}
    for name, most in (("session_sd", 1.0), ("move_sd", 1e5)):
        if document.get(name) is not None:
            of_joints = name == "session_sd" and isinstance(document[name], list)
            value = numbers(name, document[name], (nq,) if of_joints else ())
            if not ((value >= 0) & (value <= most)).all():
                raise InvalidFigures(name, f"must be from 0 to {most:g}.")
            result[name] = value.tolist()
    given = document.get("covariance")
    if given is None:
        return result
    if (
        not isinstance(given, dict)
        or set(given) != {"names", "matrix"}
        or not isinstance(given["names"], list)
    ):
        raise InvalidFigures("covariance", "must have names and matrix, and nothing else.")
    names = given["names"]
    if not 0 < len(names) <= DOCUMENT.parameters or len(set(map(str, names))) != len(names):
        raise InvalidFigures(
            "covariance.names", f"must be 1 to {DOCUMENT.parameters} different names."
        )
    for k, name in enumerate(names):
        if not _is_parameter(name, figures, nq):
            raise InvalidFigures(
                f"covariance.names.{k}",
                "is not a parameter of these figures: use paths like "
                "friction_laws.LAW.coulomb.0, drives.copper.2 or electronics.idle_power, of "
                f"{', '.join((*FRICTION, *DRIVES))} and idle_power, or inertials.m.1 with one of "
                f"{', '.join(LINKS)}.",
            )
    matrix = numbers("covariance.matrix", given["matrix"], (len(names), len(names)))
    scale = float(np.abs(matrix).max())
    if scale > DOCUMENT.variance:
        raise InvalidFigures(
            "covariance.matrix", f"must have entries of at most {DOCUMENT.variance:g}."
        )
    if (
        np.abs(matrix - matrix.T).max() > 1e-9 * scale
        or np.linalg.eigvalsh(matrix)[0] < -1e-9 * scale
    ):
        raise InvalidFigures("covariance.matrix", "must be symmetric and positive semidefinite.")
    return result | {"covariance": {"names": list(names), "matrix": matrix.tolist()}}


def _is_parameter(name: Any, figures: dict[str, Any], nq: int) -> bool:
    if not isinstance(name, str):
        return False
    if name == "electronics.idle_power":
        return True
    *path, joint = name.split(".")
    if not (joint.isdecimal() and len(joint) <= 2 and int(joint) < nq):
        return False
    if len(path) == 3 and path[0] == "friction_laws":
        return path[2] in FRICTION and path[2] in figures["friction_laws"].get(path[1], {})
    return len(path) == 2 and path[1] in {"drives": DRIVES, "inertials": LINKS}.get(path[0], ())
