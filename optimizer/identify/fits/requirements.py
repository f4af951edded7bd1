"""Requirements of an identification on its logs, and the advice if they are not met."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.errors import (
    EffortNotUsable,
    NoPowerChannel,
    NotExcited,
    PayloadUnknown,
)
from joulepath.optimizer.identify.fits.block import SCALE, terms_of
from joulepath.optimizer.identify.fits.payload_fit import joints_without_gravity
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import IdentifiedParameter
from joulepath.optimizer.identify.rows.fit_rows import Rows


def check_logs(
    robot: Robot, rows: Rows, logs: Sequence[Log], options: IdentificationOptions
) -> None:
    """Check the channels and motions of the logs against the requested figures.

    Raises:
        EffortNotUsable: the efforts of a log exclude gravity.
        InvalidProblem: requested figures exclude one another or need other channels or links.
        PayloadUnknown: torque constants are requested, and the payload is not known.
        NoPowerChannel: power is requested, and no log has it.
        NotExcited: the logs have no motion, or neither torques nor power.
    """
    if any(log.effort_meaning == "external" and log.power is None for log in logs):
        raise EffortNotUsable(
            "The efforts of these logs are without gravity and identify nothing: log motor "
            "currents or torques.",
            "external",
            {},
        )
    if "torque_constant" in options.fit and (
        not rows.current or options.needs_regressor or options.couplings
    ):
        raise InvalidProblem(
            "fit",
            "torque_constant needs motor currents, and links that are known: leave it out, or keep "
            "the inertials.",
        )
    if "torque_constant" in options.fit and (
        "payload" in options.fit or not all(log.payload_known for log in logs)
    ):
        raise PayloadUnknown(joints_without_gravity(robot, rows, logs))
    if "payload" in options.fit and (options.needs_regressor or options.couplings):
        raise InvalidProblem(
            "fit", "A payload needs links that are known, and no couplings: leave it out."
        )
    power = bool(np.isfinite(rows.power).any())
    if rows.link_side and not (power or options.needs_regressor or "payload" in options.fit):
        raise InvalidProblem(
            "inertials",
            "The torques of these logs were measured behind the gears. They identify links, and "
            "neither friction nor rotors: refit the inertials, or log motor currents.",
        )
    if "power" in options.fit and not power:
        raise NoPowerChannel
    if options.held_out and rows.rest.all() and not power:
        terms = terms_of(replace(options, constants=False))
        names = ["torque_constant" if term == SCALE else term for term in terms]
        raise not_excited(names, logs, options)
    efforts = bool(np.isfinite(rows.effort).any())
    if not power and not efforts and options.method != "base_wrench":
        raise not_excited(options.fit, logs, options)
    if "payload" in options.fit and not efforts:
        raise not_excited(["payload"], logs, options)


def check_identified(
    parameters: Sequence[IdentifiedParameter], logs: Sequence[Log], options: IdentificationOptions
) -> None:
    """Check the result for at least one identified figure among the requested ones.

    Raises:
        NotExcited: the logs identify no requested figure.
    """
    requested = [
        each
        for each in parameters
        if set(options.fit) != {"payload"} or each.figure.startswith("payload")
    ]
    if not any(each.identified for each in requested):
        raise not_excited([each.figure for each in requested], logs, options)


def not_excited(
    parameters: Sequence[str], logs: Sequence[Log], options: IdentificationOptions
) -> NotExcited:
    """Build the error, with a request for an excitation to identify the parameters.

    Friction is always excited, and links if their torques are needed.
    """
    links = options.needs_regressor or {"torque_constant", "payload"} & set(options.fit)
    excite = [
        *(["inertials"] if links else []),
        *(["rotor"] if "rotor" in options.targets else []),
        "friction",
    ]
    load = logs[0].payload
    payload = {"payload": {"mass": load.mass, "com": load.com.tolist()}} if load.mass > 0 else {}
    return NotExcited(list(parameters), {"robot": logs[0].robot, "parameters": excite, **payload})
