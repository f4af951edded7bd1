"""Identified parameters beside the robot's own values."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Robot
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY, body_parameters
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.fits.base_fit import BaseTerms
from joulepath.optimizer.identify.fits.block import own_value
from joulepath.optimizer.identify.fits.fitting import LINK_MASS_SCALE
from joulepath.optimizer.identify.fits.whole_fit import LINK
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import IdentifiedParameter


def parameters_of(
    robot: Robot, estimate: Estimate, options: IdentificationOptions
) -> tuple[IdentifiedParameter, ...]:
    """Parameters of an estimate, with a reason for every unidentified parameter."""
    base = BaseTerms.of(robot, [], options) if options.reduced else None
    own = {} if base is None else dict(zip(base.names, base.own.tolist(), strict=True))
    deviations = np.sqrt(np.diag(estimate.covariance)).tolist()
    values, remarks = estimate.value.tolist(), estimate.remarks or ("",) * len(estimate.names)
    previous = [own[n] if n in own else _own_value(robot, n) for n in estimate.names]
    return tuple(
        IdentifiedParameter(name[0], name[1], value, sd, before, not reason, reason or remark)
        for name, value, sd, before, reason, remark in zip(
            estimate.names, values, deviations, previous, estimate.reasons, remarks, strict=True
        )
    )


def _own_value(robot: Robot, name: Name) -> float:
    """The robot's own value of any figure."""
    figure, joint = name
    if figure.startswith(LINK):
        assert joint is not None
        part = LINKS.index(figure.removeprefix(LINK))
        return float(body_parameters(robot.model).reshape(-1, PARAMETERS_PER_BODY)[joint, part])
    if figure == LINK_MASS_SCALE:
        return 1.0
    if figure == "idle_power":
        return float(robot.electronics.idle_power)
    if figure in ("copper", "inverter_linear", "torque_constant"):
        return float(getattr(robot.drives, figure)[joint])
    return own_value(robot, name)
