"""Public entry point: `identify(robot, logs, options)` finds an arm's own figures from its logs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import BODY, body_parameters
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.arm.fitted_arm import own_arm
from joulepath.optimizer.identify.document import document_of
from joulepath.optimizer.identify.errors import NoPowerChannel, NotExcited, PayloadUnknown
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name
from joulepath.optimizer.identify.estimates.grouped import lag_one
from joulepath.optimizer.identify.fits.base_fit import BaseTerms
from joulepath.optimizer.identify.fits.block import own_value, terms_of
from joulepath.optimizer.identify.fits.by_method import fit_by_method, prepared
from joulepath.optimizer.identify.fits.fitting import LINK_MASS_SCALE, Fitted, motor_torque
from joulepath.optimizer.identify.fits.payload_fit import (
    Carried,
    joints_without_gravity,
    loaded,
    payload_of,
)
from joulepath.optimizer.identify.fits.temperature import temperatures_of
from joulepath.optimizer.identify.fits.torque_fit import MOST_RELATIVE_SD, UNSURE, ZERO
from joulepath.optimizer.identify.fits.whole_fit import LINK, LINK_NAMES
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.logs.log_errors import EffortNotUsable
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.quality.advice import advice_of
from joulepath.optimizer.identify.quality.curves import curves_of
from joulepath.optimizer.identify.quality.interval import Spread, sessions, spread_of
from joulepath.optimizer.identify.quality.structure import inertials_of, physical_of, structure_of
from joulepath.optimizer.identify.quality.validation import Fold, validate
from joulepath.optimizer.identify.results import (
    Advice,
    Curves,
    IdentifiedFigures,
    MeasuredNoise,
    Parameter,
    Physical,
    Residuals,
    Structure,
    Temperatures,
    Validation,
)
from joulepath.optimizer.identify.rows.fit_rows import Rows, rows_of
from joulepath.optimizer.identify.rows.split import held_out
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.problem.arm import Payload

WHITE = 0.3
"""Correlation of neighbouring residuals up to which they count as independent."""


@dataclass(frozen=True, eq=False)
class Identification:
    """An arm's figures from logs. `validation` is of a fit without the held-out moves; None if none
    was asked for.

    `payload` is what the last log carried; None if it was not asked for. `curves` show the moves
    that are not held out, as the figures predict them."""

    robot: Robot
    options: IdentificationOptions
    fitted: Fitted
    spread: Spread
    parameters: tuple[Parameter, ...]
    structure: Structure
    physical: Physical | None
    residuals: Residuals
    temperatures: Temperatures
    advice: Advice | None
    validation: Validation | None
    payload: Carried | None
    curves: Curves
    logs: tuple[str, ...]

    @property
    def noise(self) -> MeasuredNoise | None:
        """The noise of a periodic motion; None with other methods."""
        return self.fitted.noise

    @property
    def thresholds(self) -> Array | None:
        """Speeds (nq,) [rad/s] below which no sample of a joint was used, where the method finds
        them; else None."""
        return self.fitted.thresholds

    @one_thread()
    def validate(self, logs: Sequence[Log]) -> Validation:
        """Errors of the figures on other logs, none of whose moves may be in the fit. Raises
        InvalidProblem.
        """
        rows = rows_of(self.robot, logs, self.options.needs_regressor)
        return validate(
            self.robot, [Fold(self.fitted, self.spread, rows)], self.options.velocity_threshold
        )

    def figures(self) -> IdentifiedFigures:
        """The figures, complete over all joints, with their covariance."""
        arm, estimate = self.fitted.arm, self.fitted.estimate
        fitted = {figure for figure, _ in estimate.names}
        names = [name for name in (*LAW, "rotor_inertia", "torque_constant") if name in fitted]
        if fitted & set(LAW):
            names += [name for name in (*LAW, "speed") if name not in names]
        values = {name: np.array(getattr(arm, name)) for name in names}
        if "idle_power" in fitted:
            electrics = arm.electrics
            values |= {"idle_power": np.array(electrics.idle), "copper": electrics.copper}
            values["inverter_linear"] = electrics.inverter
        if LINK_MASS_SCALE in fitted:
            values |= inertials_of(self.robot, (arm.links - 1) * body_parameters(self.robot.model))
        if arm.bodies is not None and not self.options.reduced:
            values |= inertials_of(self.robot, arm.bodies)
        # those that the logs tell only together with others count, too: their errors go with the
        # others'
        turn = {
            name: row
            for name, row in self._parameters_of_figures()
            if name[0] in values or name[0] in LINK_NAMES
        }
        matrix = np.array([*turn.values()])
        covariance = matrix @ estimate.covariance @ matrix.T
        told = np.flatnonzero(np.diag(covariance) > 0)
        return IdentifiedFigures(
            robot=self.robot.name,
            values=values,
            parameters=tuple([*turn][k] for k in told.tolist()),
            sd=np.sqrt(np.diag(covariance)[told]),
            covariance=covariance[np.ix_(told, told)],
            session_sd=self.spread.session,
            move_sd=self.spread.move,
            logs=self.logs,
        )

    def document(self, date: str) -> dict[str, Any]:
        """The figures as a document, which `load_robot(robot, figures=document)` computes with.

        Args:
            date: date that the sources of the figures name.

        Returns:
            Value, unit, source, trust letter and standard deviation of each figure, and their
            covariance; see docs/identification.md.
        """
        return document_of(self.figures(), date)

    def _parameters_of_figures(self) -> Iterator[tuple[Name, Array]]:
        """The parameters of the figures that the estimate (p,) stands for, and rows (p,) that make
        them of it.
        """
        names = self.fitted.estimate.names
        for name, row in zip(names, np.eye(len(names)), strict=True):
            if name[0] == LINK_MASS_SCALE:
                for joint, body in enumerate(
                    body_parameters(self.robot.model).reshape(-1, BODY).tolist()
                ):
                    yield from (
                        ((LINK + part, joint), own * row)
                        for part, own in zip(LINKS, body, strict=True)
                    )
            else:
                yield name, row


LAW = ("coulomb", "viscous", "load", "curved")
"""Figures of the friction law: given for all joints, or not at all."""


@one_thread()
def identify(
    robot: Robot, logs: Sequence[Log], options: IdentificationOptions | None = None
) -> Identification:
    """Identify an arm's own figures from logs of its motions.

    The figures are fitted to all moves of all logs. Before that, a fit without the held-out moves
    is validated on these, unless `options.held_out` is 0.

    Args:
        robot: robot that the arm is one of; figures that the logs do not tell stay as they are.
        logs: logs of this arm, at least one, as `read_log` reads them. Where a payload is sought,
            the last one is the one with it.
        options: what to find, and how.

    Returns:
        The figures with their standard deviations, their validation, and advice on what to log.

    Raises:
        InvalidProblem: the logs or options do not fit the robot or each other.
        EffortNotUsable: the efforts of a log exclude gravity.
        MethodNotApplicable: a log does not have what the method needs.
        NoPowerChannel: power is asked for, and no log has it.
        NotExcited: the logs tell nothing of what is asked for.
        PayloadUnknown: torque constants are asked for, and nobody said what the arm carried.
        NothingHeldOut: the logs have fewer than two different motions.
    """
    logs, options = prepared(logs, options or IdentificationOptions())
    last = len(logs) - 1
    rows = _rows(robot, logs, options)
    _check(robot, rows, logs, options)
    validation, blind = None, np.zeros(len(rows.q), dtype=bool)
    if options.held_out:
        outs = held_out(rows, options.held_out)
        blind = np.any(outs, axis=0)
        folds = [_fold(robot, rows, out, options, last) for out in outs]
        validation = validate(robot, folds, options.velocity_threshold)
    carried = _carried(robot, rows, options, last)
    rows = rows if carried is None else loaded(rows, carried)
    fitted = fit_by_method(robot, rows, options)
    parameters = _parameters(robot, fitted.estimate, options)
    if carried is not None:
        parameters += carried.parameters(logs[-1].payload)
    _check_identified(parameters, logs, options)
    return Identification(
        robot=robot,
        options=options,
        fitted=fitted,
        spread=spread_of(fitted, rows),
        parameters=parameters,
        structure=structure_of(robot, rows, options),
        physical=None if options.reduced else physical_of(robot, fitted.arm),
        residuals=_residuals(fitted, rows, options),
        temperatures=temperatures_of(
            rows,
            motor_torque(fitted.arm, rows),
            fitted.arm,
            fitted.clusters,
            options.velocity_threshold,
        ),
        advice=advice_of(fitted, rows),
        validation=validation,
        payload=carried,
        curves=curves_of([(fitted.arm, rows, ~blind)], options.velocity_threshold),
        logs=tuple(log.name or "" for log in logs),
    )


def _check_identified(
    parameters: Sequence[Parameter], logs: Sequence[Log], options: IdentificationOptions
) -> None:
    """Raise NotExcited if the logs tell nothing of what is sought."""
    sought = [
        each
        for each in parameters
        if set(options.fit) != {"payload"} or each.figure.startswith("payload")
    ]
    if not any(each.identified for each in sought):
        raise _not_excited([each.figure for each in sought], logs, options)


def _rows(robot: Robot, logs: Sequence[Log], options: IdentificationOptions) -> Rows:
    """The rows of the logs. Where a payload is sought, the last log's counts as nothing, whatever
    it says.
    """
    if "payload" not in options.fit:
        return rows_of(robot, logs, options.needs_regressor, options.method == "base_wrench")
    if len(logs) < 2:
        raise InvalidProblem(
            "logs", "A payload needs two logs: one without it, and last the one with it."
        )
    return rows_of(robot, [*logs[:-1], replace(logs[-1], payload=Payload())], regressor=True)


def _carried(robot: Robot, rows: Rows, options: IdentificationOptions, last: int) -> Carried | None:
    """The payload of the `last` log, if it was asked for."""
    if "payload" not in options.fit:
        return None
    return payload_of(
        robot, rows, motor_torque(own_arm(robot), rows), last, options.velocity_threshold
    )


def _fold(robot: Robot, rows: Rows, out: Mask, options: IdentificationOptions, last: int) -> Fold:
    """The rows that are held `out` (n,), and a fit to the others, which are of the same days."""
    seen = rows.take(~out)
    carried = _carried(robot, seen, options, last)
    seen = seen if carried is None else loaded(seen, carried)
    blind = fit_by_method(robot, seen, options)
    spread = replace(spread_of(blind, seen), session=0.0)
    del seen  # rows are large
    held = rows.take(out)
    return Fold(blind, spread, held if carried is None else loaded(held, carried))


def _check(robot: Robot, rows: Rows, logs: Sequence[Log], options: IdentificationOptions) -> None:
    """Whether the logs have what was asked for."""
    if any(log.effort_meaning == "external" for log in logs):
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
    if "power" in options.fit and not power:
        raise NoPowerChannel
    if options.held_out and rows.rest.all():
        raise _not_excited(terms_of(options), logs, options)
    efforts = bool(np.isfinite(rows.effort).any())
    if not power and not efforts and options.method != "base_wrench":
        raise _not_excited(options.fit, logs, options)
    if "payload" in options.fit and not efforts:
        raise _not_excited(["payload"], logs, options)


def _not_excited(
    parameters: Sequence[str], logs: Sequence[Log], options: IdentificationOptions
) -> NotExcited:
    """With the excitation that would tell them: friction always, and what the torques of the links
    tell.
    """
    links = options.needs_regressor or {"torque_constant", "payload"} & set(options.fit)
    excite = [
        *(["inertials"] if links else []),
        *(["rotor"] if "rotor" in options.targets else []),
        "friction",
    ]
    carried = logs[0].payload
    payload = (
        {"payload": {"mass": carried.mass, "com": carried.com.tolist()}} if carried.mass > 0 else {}
    )
    return NotExcited(list(parameters), {"robot": logs[0].robot, "parameters": excite, **payload})


def _parameters(
    robot: Robot, estimate: Estimate, options: IdentificationOptions
) -> tuple[Parameter, ...]:
    base = BaseTerms.of(robot, [], options) if options.reduced else None
    own = {} if base is None else dict(zip(base.names, base.own.tolist(), strict=True))
    deviations = np.sqrt(np.diag(estimate.covariance))
    return tuple(
        _parameter(name, value, sd, own[name] if name in own else _previous(robot, name), why)
        for name, value, sd, why in zip(
            estimate.names, estimate.value.tolist(), deviations.tolist(), estimate.why, strict=True
        )
    )


def _parameter(name: Name, value: float, sd: float, previous: float, why: str) -> Parameter:
    if not why and value == 0:
        why = ZERO
    elif not why and not sd <= MOST_RELATIVE_SD * abs(value):
        why = UNSURE.format(sd / abs(value))
    return Parameter(*name, value, sd, previous, not why, why)


def _previous(robot: Robot, name: Name) -> float:
    figure, joint = name
    if figure.startswith(LINK):
        assert joint is not None
        return float(
            body_parameters(robot.model).reshape(-1, BODY)[
                joint, LINKS.index(figure.removeprefix(LINK))
            ]
        )
    if figure == LINK_MASS_SCALE:
        return 1.0
    if figure == "idle_power":
        return float(robot.electronics.idle_power)
    if figure in ("copper", "inverter_linear", "torque_constant"):
        return float(getattr(robot.drives, figure)[joint])
    return own_value(robot, name)


def _residuals(fitted: Fitted, rows: Rows, options: IdentificationOptions) -> Residuals:
    """What the fit leaves over, of moving rows."""
    error = motor_torque(fitted.arm, rows) - fitted.arm.torque(rows)
    moving = np.abs(rows.v) > options.velocity_threshold
    lags = np.full(rows.v.shape[1], np.nan)
    for joint in range(len(lags)):
        use = moving[:, joint] & np.isfinite(error[:, joint])
        if use.any():
            lags[joint] = lag_one(error[use, joint], rows.move[use])
    with_power, lag = np.isfinite(rows.power), np.nan
    if with_power.any():
        part = rows.take(with_power)
        lag = lag_one(part.power - fitted.arm.power(part)[0], part.move)
    every = np.append(lags, lag)
    return Residuals(
        lags, lag, bool((every[np.isfinite(every)] < WHITE).all()), sessions(fitted, rows)
    )
