"""Public entry point: `identify(robot, logs, options)` finds an arm's own figures from its logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.arm.fitted_arm import own_arm
from joulepath.optimizer.identify.document import document_of
from joulepath.optimizer.identify.fits.by_method import fit_by_method, prepare
from joulepath.optimizer.identify.fits.fitting import FitResult
from joulepath.optimizer.identify.fits.payload_fit import (
    IdentifiedPayload,
    fit_payload,
    with_payload,
)
from joulepath.optimizer.identify.fits.requirements import check_identified, check_logs
from joulepath.optimizer.identify.fits.temperature import temperatures_of
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.quality.advice import advice_of
from joulepath.optimizer.identify.quality.answered import AnsweredEnergies
from joulepath.optimizer.identify.quality.figures import figures_of, parameters_of
from joulepath.optimizer.identify.quality.interval import Spread, spread_of
from joulepath.optimizer.identify.quality.mains import IdentifiedMains, fit_mains
from joulepath.optimizer.identify.quality.residuals import residuals_of
from joulepath.optimizer.identify.quality.structure import physical_of, structure_of
from joulepath.optimizer.identify.quality.validation import (
    Fold,
    curves_of,
    held_out_masks,
    validate,
)
from joulepath.optimizer.identify.results import (
    Advice,
    Curves,
    IdentifiedFigures,
    IdentifiedParameter,
    MeasuredNoise,
    Physical,
    Residuals,
    Structure,
    Temperatures,
    Validation,
)
from joulepath.optimizer.identify.rows.fit_rows import Rows, rows_of
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.presentation.declared_fields import shown_fields
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.presentation.result import Result
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.uncoupled import check_uncoupled
from joulepath.optimizer.progress import Steps, TellSteps, no_listener


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Result):
    """An arm's figures from logs, with their uncertainty and validation."""

    robot: Robot
    options: IdentificationOptions
    fitted: FitResult
    spread: Spread
    parameters: tuple[IdentifiedParameter, ...]
    structure: Structure
    physical: Physical | None
    residuals: Residuals
    temperatures: Temperatures
    validation: Validation | None
    """Errors of a fit without the held-out moves; None if no moves are held out."""
    payload: IdentifiedPayload | None
    """Payload of the last log; None if it was not requested."""
    curves: Curves
    """Moves that are not held out, as the figures predict them."""
    logs: tuple[str, ...]
    mains: IdentifiedMains | None = None
    """What the control box draws; None without readings of a wattmeter."""
    measure: tuple[Advice, ...] = ()
    """What to measure next, in the order of its share in the interval of an energy."""

    @property
    def advice(self) -> Advice | None:
        """The most useful further measurement; None if none is known."""
        return next(iter(self.measure), None)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Remarks on poorly known figures whose own values the logs reject, or know better."""
        return tuple(each.named_remark for each in self.parameters if each.identified and each.why)

    @property
    def noise(self) -> MeasuredNoise | None:
        """Noise of a periodic motion; None for other methods."""
        return self.fitted.noise

    @property
    def thresholds(self) -> Array | None:
        """Speeds (nq,) [rad/s] below which no sample of a joint was used; None for other
        methods."""
        return self.fitted.thresholds

    @one_thread()
    def validate(self, logs: Sequence[Log]) -> Validation:
        """Errors of the figures on other logs.

        Args:
            logs: logs of the same robot that were not part of the fit.

        Raises:
            InvalidProblem: a log does not fit the robot.
        """
        rows = rows_of(self.robot, logs, self.options.needs_regressor)
        return validate(
            self.robot, [Fold(self.fitted, self.spread, rows)], self.options.velocity_threshold
        )

    def figures(self) -> IdentifiedFigures:
        """Figures of all joints, with their covariance."""
        return figures_of(
            self.robot, self.fitted, self.spread, self.options, self.parameters, self.logs
        )

    def document(self, date: str) -> dict[str, Any]:
        """The figures as a document, which `load_robot(robot, figures=document)` computes with.

        Args:
            date: date of the sources of the figures.

        Returns:
            Value, unit, source, trust letter and standard deviation of each figure, and their
            covariance; see docs/reference/identification.md.
        """
        document = document_of(self.robot.figures, self.robot.friction.name, self.figures(), date)
        if self.mains is None:
            return document
        logs = ", ".join(self.logs)
        source = f"identified from readings of a wattmeter during logs {logs}, {date}"
        return document | {"mains": self.mains.figures(source)}

    def _headline(self) -> str:
        told = sum(each.identified for each in self.parameters)
        text = f"{self.robot.name}, {told} of {len(self.parameters)} figures identified"
        power = self.validation and self.validation.fitted.power
        if power and self.validation:
            text += f", {power.energy_mean:.2g} % error of energy on {self.validation.moves} moves"
        return text

    def _rows(self) -> Sequence[Sequence[str]]:
        names = ("figure", "joint", "value", "sd", "previous")
        rows = (
            [_cell(getattr(each, name)) for name in names]
            for each in self.parameters
            if each.identified
        )
        return [names, *rows]

    def _shown(self) -> Any:
        names = (
            *("parameters", "structure", "physical", "validation", "residuals", "temperatures"),
            *("noise", "thresholds", "measure"),
        )
        return {"robot": self.robot.name} | {name: getattr(self, name) for name in names}

    def _columns(self) -> dict[str, Any]:
        """One row per figure that was sought."""
        names = shown_fields(IdentifiedParameter)
        return {name: [getattr(each, name) for each in self.parameters] for name in names}


def _cell(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


@checked_arguments
@one_thread()
def identify(
    robot: Robot,
    logs: Sequence[Log],
    options: IdentificationOptions | None = None,
    *,
    tell: TellSteps = no_listener,
    progress: bool = True,
) -> Identification:
    """Identify an arm's own figures from logs of its motions.

    The figures are fitted to all moves of all logs. Before that, a fit without the held-out moves
    is validated on these, unless `options.held_out` is 0.

    Args:
        robot: robot with its own figures, which are kept for everything the logs do not identify.
        logs: logs of one arm, at least one, as read by `read_log`; with a requested payload, the
            last log is the one with the payload.
        options: requested figures, method and held-out share.
        tell: gets the progress, in fits: those without held-out moves, and the last to all moves.
        progress: whether a bar may show the progress, on a terminal or in a notebook, unless
            `tell` is given.

    Returns:
        The figures with their standard deviations, their validation, and advice for further logs.

    Raises:
        InvalidProblem: the logs or options do not fit the robot or each other.
        EffortNotUsable: the efforts of a log exclude gravity.
        MethodNotApplicable: a log lacks a channel or property for the method.
        NoPowerChannel: power is requested, and no log has it.
        NotExcited: the logs identify none of the requested figures.
        PayloadUnknown: torque constants are requested, and the payload is not known.
        NothingHeldOut: the logs have fewer than two different motions.
    """
    check_uncoupled(robot, "robot", "Figures are not identified")
    logs, options = prepare(robot, logs, options or IdentificationOptions())
    with progress_bar("Identifying", tell, progress) as tell:
        return _identified(robot, logs, options, tell)


def _identified(
    robot: Robot, logs: Sequence[Log], options: IdentificationOptions, tell: TellSteps
) -> Identification:
    """The identification from prepared logs."""
    last = len(logs) - 1
    if len(options.mains) not in (0, len(logs)):
        given = len(options.mains)
        raise InvalidProblem(
            "mains", f"mains needs one reading for each log: {len(logs)} in all, not {given}."
        )
    rows = _rows(robot, logs, options)
    check_logs(robot, rows, logs, options)
    split = options.held_out and not rows.rest.all()
    masks = held_out_masks(rows, options.held_out) if split else []
    steps = Steps("fits", len(masks) + 1, tell)
    validation, held_out = _validation(robot, rows, options, masks, last, steps)
    payload = _payload(robot, rows, options, last)
    rows = rows if payload is None else with_payload(rows, payload)
    fitted = fit_by_method(robot, rows, options)
    steps.add()
    parameters = parameters_of(robot, fitted.estimate, options)
    if payload is not None:
        parameters += payload.parameters(logs[-1].payload)
    check_identified(parameters, logs, options)
    threshold = options.velocity_threshold
    found = Identification(
        robot=robot,
        options=options,
        fitted=fitted,
        spread=spread_of(fitted, rows, threshold),
        parameters=parameters,
        structure=structure_of(robot, rows, options),
        physical=None if options.reduced else physical_of(robot, fitted.arm),
        residuals=residuals_of(fitted, rows, threshold),
        temperatures=temperatures_of(
            rows, fitted.arm.motor_torque(rows), fitted.arm, fitted.clusters, threshold
        ),
        validation=validation,
        payload=payload,
        curves=curves_of([(fitted.arm, rows, ~held_out)], threshold),
        logs=tuple(log.name or "" for log in logs),
    )
    energies = AnsweredEnergies.of(robot, found.document(""), fitted.arm)
    mains = fit_mains(energies, rows, options.mains)
    return replace(found, mains=mains, measure=advice_of(energies, rows))


def _validation(
    robot: Robot,
    rows: Rows,
    options: IdentificationOptions,
    masks: Sequence[Mask],
    last: int,
    steps: Steps,
) -> tuple[Validation | None, Mask]:
    """Validation by the held-out moves of each mask, if any, and all held-out rows (n,)."""
    if not masks:
        return None, np.zeros(len(rows.q), dtype=bool)
    folds = [_fold(robot, rows, mask, options, last) for mask in steps.each(masks)]
    return validate(robot, folds, options.velocity_threshold), np.any(masks, axis=0)


def _rows(robot: Robot, logs: Sequence[Log], options: IdentificationOptions) -> Rows:
    """Rows of the logs; a requested payload replaces the stated payload of the last log."""
    if "payload" not in options.fit:
        return rows_of(robot, logs, options.needs_regressor, options.method == "base_wrench")
    if len(logs) < 2:
        raise InvalidProblem(
            "logs", "A payload needs two logs: first one without the payload, last one with it."
        )
    return rows_of(robot, [*logs[:-1], replace(logs[-1], payload=Payload())], regressor=True)


def _payload(
    robot: Robot, rows: Rows, options: IdentificationOptions, last: int
) -> IdentifiedPayload | None:
    """Payload of the `last` log, if it is requested."""
    if "payload" not in options.fit:
        return None
    return fit_payload(
        robot, rows, own_arm(robot).logged_torque(rows), last, options.velocity_threshold
    )


def _fold(
    robot: Robot, rows: Rows, held_out: Mask, options: IdentificationOptions, last: int
) -> Fold:
    """Held-out rows, and a fit to all other rows, which are of the same days."""
    seen = rows.take(~held_out)
    payload = _payload(robot, seen, options, last)
    seen = seen if payload is None else with_payload(seen, payload)
    fitted = fit_by_method(robot, seen, options)
    spread = replace(
        spread_of(fitted, seen, options.velocity_threshold), session_sd=np.zeros(robot.nq)
    )
    del seen  # rows are large
    unseen = rows.take(held_out)
    return Fold(fitted, spread, unseen if payload is None else with_payload(unseen, payload))
