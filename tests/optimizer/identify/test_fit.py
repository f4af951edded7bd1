"""Friction, rotor inertia and power from logs of simulated arms with known parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    EffortNotUsable,
    Identification,
    IdentificationOptions,
    InvalidProblem,
    Log,
    LogMove,
    MethodNotApplicable,
    NoPowerChannel,
    NotExcited,
    NothingHeldOut,
    Payload,
    identify,
    load_robot,
)
from joulepath.models.robot import Array
from joulepath.optimizer.identify.quality import validation as validation_module
from tests.identification_logs import (
    FAR,
    GRAVITY,
    WITHOUT_SPLIT,
    Noise,
    Recording,
    Truth,
    power_errors,
    recorded,
    torque_errors,
    truth_of,
)
from tests.refusals import refusal_of
from tests.selection import long_but

ROBOT = load_robot("ur10e")
# rows of all curves together, in place of the service's number: logs are shorter, too
MOST = 100
# joints with an identifiable load term
LOADED = (1, 2)


def run(
    seed: int = 0, moves: int = 14, options: IdentificationOptions = WITHOUT_SPLIT
) -> tuple[Truth, Identification]:
    truth = truth_of(ROBOT, seed)
    return truth, identify(ROBOT, [recorded(ROBOT, truth, moves=moves, seed=seed).log()], options)


def true_value(truth: Truth, figure: str, joint: int | None) -> float:
    return float(truth.idle_power if joint is None else getattr(truth, figure)[joint])


def without_power(log: Log, **changed: object) -> Log:
    return replace(log, power=None, **changed)  # type: ignore[arg-type]


def test_every_friction_figure_is_found_within_its_standard_deviations() -> None:
    truth, found = run()
    # an omitted load term biases the other terms of its joint
    told = [
        each for each in found.parameters if each.identified and each.joint in (*LOADED, 3, 4, 5)
    ]
    figures = [
        each for each in told if each.figure in ("coulomb", "viscous", "load", "rotor_inertia")
    ]
    assert len(figures) >= 3 * 5
    assert {each.joint for each in figures if each.figure == "load"} == set(LOADED)
    for each in figures:
        assert abs(each.value - true_value(truth, each.figure, each.joint)) <= FAR * each.sd, each


def test_the_fitted_figures_predict_held_out_moves_better_than_the_robots_own() -> None:
    _, found = run(options=IdentificationOptions())
    torque, own_torque = torque_errors(found.validation)
    # the residual is the noise of the current
    assert (torque.relative < 0.5 * own_torque.relative).all()
    power, own_power = power_errors(found.validation)
    assert found.validation is not None and found.validation.constant is not None
    assert power.energy_max < own_power.energy_max < found.validation.constant.energy_max


@pytest.mark.long
def test_curves_show_each_row_by_figures_that_may_predict_it() -> None:
    """Curves show every move once; their residuals have the size stated by the validation."""
    _, found = run(options=IdentificationOptions())
    assert found.validation is not None and found.validation.fitted.torque is not None
    seen, blind = found.curves, found.validation.curves
    assert not set(seen.move) & set(blind.move) and set(seen.move) | set(blind.move) == set(
        range(14)
    )
    assert len(np.unique(blind.move)) == found.validation.moves
    left = blind.torque - blind.modelled_torque
    # every k-th row: a sample of the rows averaged by the validation
    np.testing.assert_allclose(
        np.sqrt(np.nanmean(left**2, axis=0)), found.validation.fitted.torque.rmse, rtol=0.1
    )
    assert found.validation.fitted.power is not None
    left = blind.power - blind.modelled_power
    np.testing.assert_allclose(
        np.sqrt(np.mean(left**2)), found.validation.fitted.power.rmse, rtol=0.1
    )
    for curves in (seen, blind):
        assert (np.diff(curves.time)[np.diff(curves.move) == 0] > 0).all()


@pytest.mark.long
def test_curves_of_long_logs_are_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(validation_module, "CURVES", validation_module.CurveSettings(max_rows=MOST))
    truth = truth_of(ROBOT)
    logs = [recorded(ROBOT, truth, moves=4, seed=seed).log() for seed in (0, 1, 2)]
    found = identify(ROBOT, logs[:2], IdentificationOptions(held_out=1.0))
    assert found.validation is not None
    curves, moves = found.validation.curves, found.validation.moves
    assert MOST - moves < len(curves.time) <= MOST + moves
    assert set(curves.log) == {0, 1} and len(np.unique(curves.move)) == moves == 2 * 4
    assert not len(found.curves.time), "each motion was held out in its turn"
    assert set(found.validate(logs[2:]).curves.log) == {0}


def test_what_was_not_measured_is_not_modelled() -> None:
    truth = truth_of(ROBOT)
    log = recorded(ROBOT, truth, moves=4).log()
    curves = identify(ROBOT, [without_power(log)], WITHOUT_SPLIT).curves
    assert np.isnan(curves.power).all() and np.isnan(curves.modelled_power).all()
    assert np.isfinite(curves.torque).all() and 0.3 < np.isfinite(curves.modelled_torque).mean() < 1
    curves = identify(ROBOT, [replace(log, effort=None, effort_meaning=None)], WITHOUT_SPLIT).curves
    assert np.isnan(curves.modelled_torque).all() and np.isfinite(curves.modelled_power).all()


def test_load_friction_makes_the_difference_where_there_is_load() -> None:
    plain = IdentificationOptions(terms=("coulomb", "viscous", "offset"))
    better, worse = (
        torque_errors(run(options=options)[1].validation)[0]
        for options in (IdentificationOptions(), plain)
    )
    assert (better.rmse[list(LOADED)] < 0.5 * worse.rmse[list(LOADED)]).all()


@pytest.mark.parametrize("scale", long_but([0.88], [0.88, 1.0]))
def test_power_alone_tells_how_heavy_the_links_are(scale: float) -> None:
    """The power of lifting determines the scale of the links; the known payload is not scaled."""
    none = np.zeros((3, 3))
    real = replace(ROBOT, model=ROBOT.loaded_model(0.0, none[0], none, GRAVITY, np.full(6, scale)))
    truth = truth_of(ROBOT, 3, Payload(mass=4.0, com=np.array([0.0, 0.0, 0.05])))
    log = replace(recorded(real, truth, moves=14, seed=3).log(), effort=None, effort_meaning=None)
    found = identify(ROBOT, [log])
    links = next(each for each in found.parameters if each.figure == "link_mass_scale")
    assert (
        links.identified
        and links.previous == 1.0
        and abs(links.value - scale) <= FAR * links.sd < 0.1
    )
    idle = next(each for each in found.parameters if each.figure == "idle_power")
    assert idle.identified and abs(idle.value - truth.idle_power) <= FAR * idle.sd
    fitted, robots = power_errors(found.validation)
    assert fitted.energy_mean < 0.5 * robots.energy_mean
    document = found.document("2026-01-01")
    heavier = load_robot("ur10e", figures=document).model
    for own, body in zip(list(ROBOT.model.inertias)[1:], list(heavier.inertias)[1:], strict=True):
        np.testing.assert_allclose(body.mass, links.value * own.mass)
        np.testing.assert_allclose(body.lever, own.lever, atol=1e-9)
        np.testing.assert_allclose(body.inertia, links.value * own.inertia, rtol=1e-6, atol=1e-9)


def test_power_without_lifting_does_not_tell_how_heavy_the_links_are() -> None:
    """The arm turns about its upright axis alone."""
    log = recorded(ROBOT, truth_of(ROBOT), moves=8).log()
    first = np.arange(ROBOT.nq) == 0
    motion = {name: np.where(first, getattr(log, name), 0.0) for name in ("q", "v", "a")}
    speed, noise = np.abs(log.v[:, 0]), np.random.default_rng(0).normal(0.0, 0.5, len(log.v))
    turned = replace(
        log,
        **motion,
        power=40 + 10 * speed + 9 * speed**2 + noise,
        effort=None,
        effort_meaning=None,
    )
    found = {
        (each.figure, each.joint): each
        for each in identify(ROBOT, [turned], WITHOUT_SPLIT).parameters
    }
    assert found["idle_power", None].identified
    assert not found["link_mass_scale", None].identified and found["link_mass_scale", None].why
    assert not found["coulomb", 3].identified


def still(recording: Recording, joint: int) -> Log:
    """The log of the recording with one joint at rest: its torque is the holding torque alone."""
    log = recording.log()
    q, v, a, effort = (np.array(each) for each in (log.q, log.v, log.a, log.effort))
    q[:, joint], v[:, joint], a[:, joint] = 0.3, 0.0, 0.0
    effort[:, joint] = 0.1
    return without_power(log, q=q, v=v, a=a, effort=effort)


def test_a_joint_that_does_not_move_keeps_the_robots_own_figures() -> None:
    truth = truth_of(ROBOT)
    found = identify(ROBOT, [still(recorded(ROBOT, truth, moves=8), 5)], WITHOUT_SPLIT)
    kept = [each for each in found.parameters if each.joint == 5 and each.figure != "offset"]
    assert kept and not any(each.identified for each in kept)
    assert all(each.why and each.value == each.previous for each in kept)
    figures = found.figures()
    for name in ("coulomb", "viscous", "curved", "speed"):
        assert figures.values[name][5] == getattr(ROBOT.friction, name)[5]


def at_rest(log: Log) -> Log:
    zeros = np.zeros_like(log.v)
    still = {"q": np.tile(log.q[:1], (len(log.q), 1)), "v": zeros, "a": zeros}
    return without_power(log, **still, moves=(LogMove(0, len(log.q), True),))


def test_a_log_at_rest_identifies_nothing() -> None:
    log = recorded(ROBOT, truth_of(ROBOT), moves=2).log()
    with pytest.raises(NotExcited) as caught:
        identify(ROBOT, [at_rest(log)], WITHOUT_SPLIT)
    assert "coulomb" in caught.value.parameters
    assert caught.value.advice == {"robot": "ur10e", "parameters": ["rotor", "friction"]}


@pytest.mark.parametrize("moves", [1, 2])
def test_moves_along_one_motion_are_no_validation(moves: int) -> None:
    """The second of two moves is the first one backwards."""
    log = recorded(ROBOT, truth_of(ROBOT), moves=moves).log()
    with pytest.raises(NothingHeldOut) as caught:
        identify(ROBOT, [log])
    assert caught.value.moves == moves


def test_one_long_move_is_fitted_by_its_seconds() -> None:
    """No move can be held out, but other logs can validate."""
    truth = truth_of(ROBOT)
    log = without_power(recorded(ROBOT, truth, moves=6).log())
    one = replace(log, moves=(LogMove(0, len(log.q), False),))
    found = identify(ROBOT, [one], WITHOUT_SPLIT)
    assert found.validation is None
    coulomb = [
        each for each in found.parameters if each.figure == "coulomb" and each.joint in LOADED
    ]
    assert all(each.identified for each in coulomb)
    assert all(
        abs(each.value - truth.coulomb[each.joint or 0]) <= FAR * each.sd for each in coulomb
    )


def test_a_repeated_log_is_on_one_side_of_the_split() -> None:
    recording = recorded(ROBOT, truth_of(ROBOT), moves=2)
    with pytest.raises(NothingHeldOut):
        identify(ROBOT, [recording.log(), recording.log()])


def test_gravity_compensated_efforts_are_refused() -> None:
    log = recorded(ROBOT, truth_of(ROBOT), moves=2).log("torque")
    external = replace(log, effort_meaning="external")
    with pytest.raises(EffortNotUsable):
        identify(ROBOT, [without_power(external)])
    with pytest.raises(MethodNotApplicable):
        identify(ROBOT, [external], IdentificationOptions(method="base_parameters"))


def test_a_log_with_gravity_compensated_efforts_is_identified_by_its_power() -> None:
    log = recorded(ROBOT, truth_of(ROBOT), moves=6).log("torque")
    found = identify(ROBOT, [replace(log, effort_meaning="external")])
    alone = identify(ROBOT, [replace(log, effort=None, effort_meaning=None)])
    assert [each.value for each in found.parameters] == [each.value for each in alone.parameters]
    assert found.validation is not None and found.validation.fitted.torque is None


def test_power_figures_are_identified_though_the_robots_own_are_0() -> None:
    """For a user's own robot, or after an earlier fit has set parameters to their bound of 0."""
    drives = replace(ROBOT.drives, copper=np.zeros(ROBOT.nq))
    bare = replace(ROBOT, drives=drives, electronics=replace(ROBOT.electronics, idle_power=0.0))
    truth = truth_of(ROBOT)
    log = recorded(ROBOT, truth, moves=14).log()
    found = identify(bare, [log], WITHOUT_SPLIT)
    idle = next(each for each in found.parameters if each.figure == "idle_power")
    assert idle.identified and abs(idle.value - truth.idle_power) < FAR * idle.sd
    assert any(each.figure == "copper" and each.identified for each in found.parameters)


def test_power_is_asked_of_logs_that_have_it() -> None:
    log = without_power(recorded(ROBOT, truth_of(ROBOT), moves=2).log())
    with pytest.raises(NoPowerChannel):
        identify(ROBOT, [log], IdentificationOptions(fit=("friction", "power")))


@pytest.mark.parametrize("factor", long_but([1e-3, -1.0], [0.0, 1e-3, 1e3, -1.0]))
def test_what_is_no_power_in_watts_is_refused(factor: float) -> None:
    """Nothing, kW, mW, and the other sign."""
    log = recorded(ROBOT, truth_of(ROBOT), moves=4).log()
    assert log.power is not None
    wrong = replace(log, power=factor * log.power)
    with refusal_of("logs", match="not the power"):
        identify(ROBOT, [wrong], WITHOUT_SPLIT)
    with pytest.raises(InvalidProblem, match="not the power"):
        identify(ROBOT, [log], WITHOUT_SPLIT).validate([wrong])


def with_outliers(log: Log) -> Log:
    random = np.random.default_rng(1)
    assert log.effort is not None
    effort: Array = np.array(log.effort)
    hit = random.random(effort.shape) < 0.02
    effort[hit] += random.uniform(5, 20, int(hit.sum()))
    return without_power(log, effort=effort)


def test_reweighting_keeps_outliers_out() -> None:
    truth = truth_of(ROBOT)
    # at the rate of the rows: no average over samples spreads an outlier
    log = with_outliers(recorded(ROBOT, truth, moves=10, rate=100.0).log())

    def error(found: Identification) -> Array:
        # of the offset, the parameter most affected by one-sided outliers
        return np.abs(found.fitted.arm.offset - truth.offset)[list(LOADED)]

    plain, robust = (
        identify(ROBOT, [log], replace(WITHOUT_SPLIT, estimator=each)) for each in ("wls", "irls")
    )
    assert (error(robust) < 0.2 * error(plain)).all()


def test_more_noise_gives_larger_standard_deviations() -> None:
    truth = truth_of(ROBOT)
    loud = Noise(current=0.2)
    quiet_log, loud_log = (
        without_power(recorded(ROBOT, truth, noise=each).log()) for each in (None, loud)
    )
    quiet_sd, loud_sd = (
        {
            (each.figure, each.joint): each.sd
            for each in identify(ROBOT, [log], WITHOUT_SPLIT).parameters
            if each.identified
        }
        for log in (quiet_log, loud_log)
    )
    shared = quiet_sd.keys() & loud_sd.keys()
    assert len(shared) > 12
    # ten times the noise: some ten times the standard deviation
    assert 3 < np.median([loud_sd[key] / quiet_sd[key] for key in shared]) < 20


def test_torque_constants_follow_from_gravity_where_the_payload_is_known() -> None:
    """Paes: with known links, the holding current gives the torque constant [N·m/A]."""
    truth = truth_of(ROBOT, 2)
    real = truth.torque_constant * np.array([1.0, 1.06, 0.95, 1.04, 1.0, 1.0])
    log = without_power(recorded(ROBOT, replace(truth, torque_constant=real), moves=14).log())
    asked = replace(WITHOUT_SPLIT, fit=("friction", "rotor", "torque_constant"))
    found = identify(ROBOT, [log], asked)
    by_name = {(each.figure, each.joint): each for each in found.parameters}
    for joint in LOADED:
        constant = by_name["torque_constant", joint]
        assert constant.identified and constant.sd < 0.02 * real[joint] / FAR
        assert abs(constant.value - real[joint]) <= FAR * constant.sd
    # gravity exerts no torque on wrist 3
    wrist = by_name["torque_constant", 5]
    assert not wrist.identified and wrist.value == ROBOT.drives.torque_constant[5]
    coulomb = by_name["coulomb", 1]
    assert abs(coulomb.value - truth.coulomb[1]) <= FAR * coulomb.sd
    # torque constants are fitted by default, unless the payload or the links are unknown
    letters = dict(ROBOT.figures)
    mass = letters["inertials"]["mass"] | {"trust": "E"}
    letters["inertials"] = letters["inertials"] | {"mass": mass}
    told, *kept = (
        identify(robot, [given], options).fitted.arm.torque_constant
        for robot, given, options in (
            (ROBOT, log, WITHOUT_SPLIT),
            (ROBOT, replace(log, payload_known=False), WITHOUT_SPLIT),
            (replace(ROBOT, figures=letters), log, WITHOUT_SPLIT),
            (ROBOT, log, replace(WITHOUT_SPLIT, constants=False)),
            (ROBOT, log, replace(WITHOUT_SPLIT, refit=True)),
        )
    )
    np.testing.assert_array_equal(told, found.fitted.arm.torque_constant)
    assert all((each == ROBOT.drives.torque_constant).all() for each in kept)


def test_torque_constants_are_asked_of_currents_only() -> None:
    log = without_power(recorded(ROBOT, truth_of(ROBOT), moves=2).log("torque"))
    with pytest.raises(InvalidProblem, match="currents"):
        identify(ROBOT, [log], IdentificationOptions(fit=("torque_constant",), held_out=0.0))
