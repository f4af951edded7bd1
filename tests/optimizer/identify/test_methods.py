"""Identification methods of the literature, by author, on simulated logs with known parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    Identification,
    IdentificationOptions,
    Log,
    LogMove,
    MethodNotApplicable,
    Payload,
    identify,
    load_robot,
)
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import (
    base_wrench_regressor,
    body_parameters,
    rigid_regressor,
    rigid_torques,
)
from joulepath.optimizer.identify.arm.base_parameters import base_parameters
from joulepath.optimizer.identify.choices import Term
from joulepath.optimizer.identify.fits.threshold import velocity_threshold
from tests.identification_logs import FAR, WITHOUT_SPLIT, Truth, recorded, torque_errors, truth_of

ROBOT = load_robot("ur5e")
ROUNDING = 1e-9
PERIOD, RATE, HARMONICS = 10.0, 50.0, 5


def fourier(nq: int, periods: int, seed: int = 0) -> tuple[Array, Array, Array]:
    """q, v, a (n, nq) of a Fourier series as Swevers gives it."""
    random = np.random.default_rng(seed)
    t, w = np.arange(round(periods * PERIOD * RATE)) / RATE, 2 * np.pi / PERIOD
    q, v, a = (np.zeros((len(t), nq)) for _ in range(3))
    for k in range(1, HARMONICS + 1):
        one, other = random.uniform(-0.6, 0.6, (2, nq))
        sine, cosine = np.sin(k * w * t)[:, None], np.cos(k * w * t)[:, None]
        q += (one * sine - other * cosine) / (k * w)
        v += one * cosine + other * sine
        a += k * w * (other * cosine - one * sine)
    return q, v, a


def log_of(truth: Truth, q: Array, v: Array, a: Array, noise: Array, **channels: Any) -> Log:
    """A log of torques with noise of standard deviations (nq,) [N·m]."""
    rigid = rigid_torques(ROBOT.model, q, v, a)
    friction = truth.coulomb * v / np.hypot(v, ROBOT.friction.knee) + truth.viscous * v
    torque = rigid + truth.rotor_inertia * a + friction
    torque += np.random.default_rng(1).normal(0.0, 1.0, torque.shape) * noise
    return Log(
        robot="ur5e",
        time=np.arange(len(q)) / RATE,
        q=q,
        v=v,
        a=a,
        effort=torque,
        effort_meaning="torque",
        rate=RATE,
        moves=(LogMove(0, len(q), False),),
        **channels,
    )


def away(found: Identification, truth: Truth) -> Array:
    """Errors of the fitted parameters over their standard deviations; the true base parameters are
    the robot's own."""
    errors = []
    for each in found.parameters:
        true = (
            each.previous if each.joint is None else float(getattr(truth, each.figure)[each.joint])
        )
        errors.append((each.value - true) / each.sd)
    return np.array(errors)


PLAIN: tuple[Term, ...] = ("coulomb", "viscous")
SIZES = np.array([2.0, 2.0, 1.0, 0.2, 0.2, 0.1])


def test_maximum_likelihood_from_a_periodic_excitation() -> None:
    """Swevers: joints with noise of different size are weighted by it, and the covariance holds."""
    truth, (q, v, a) = truth_of(ROBOT), fourier(ROBOT.nq, 8)
    # of rotors indistinguishable from links, the true inertia is the robot's own
    truth = replace(truth, rotor_inertia=ROBOT.drives.rotor_inertia)
    options = IdentificationOptions(method="periodic", period=PERIOD, terms=PLAIN, held_out=0.0)
    log = log_of(truth, q, v, a, SIZES)
    found = identify(ROBOT, [log], options)
    assert found.noise is not None and found.noise.periods == 8
    assert found.noise.deviation == pytest.approx(SIZES, rel=0.06)
    assert found.noise.excess == pytest.approx(1.0, abs=0.1)
    # 40 base parameters, including four rotors, and 12 friction parameters
    assert len(found.parameters) == 52 and np.abs(away(found, truth)).max() < FAR
    assert np.mean(away(found, truth) ** 2) == pytest.approx(1.0, abs=0.6)
    # an unmodelled torque raises the excess of the noise
    missed = replace(log, effort=np.array(log.effort) + np.where(np.abs(v) < 0.3, np.sign(v), 0.0))
    wrong = identify(ROBOT, [missed], options)
    assert wrong.noise is not None and wrong.noise.excess > 2
    # another motion, predicted by parameters without a physical body
    others = log_of(truth, *fourier(ROBOT.nq, 1, seed=5), SIZES)
    assert torque_errors(found.validate([others]))[0].rmse == pytest.approx(SIZES, rel=0.15)
    assert found.physical is None and "mass" not in found.figures().values


@pytest.mark.parametrize(
    ("periods", "period", "said"), [(1, PERIOD, "1 whole periods"), (4, 0.9 * PERIOD, "rad apart")]
)
def test_a_log_without_periods_is_refused(periods: int, period: float, said: str) -> None:
    log = log_of(truth_of(ROBOT), *fourier(ROBOT.nq, periods), SIZES)
    with pytest.raises(MethodNotApplicable, match=said):
        identify(
            ROBOT, [log], IdentificationOptions(method="periodic", period=period, held_out=0.0)
        )


def test_base_parameters_without_knowledge_of_the_links() -> None:
    """Gautier: of a robot with other links, base parameters and friction are found, and torques
    predicted."""
    truth = replace(truth_of(ROBOT), rotor_inertia=ROBOT.drives.rotor_inertia)
    log = log_of(truth, *fourier(ROBOT.nq, 4), 0.1 * SIZES)
    model = ROBOT.model.copy()
    for body in list(model.inertias)[1:]:
        body.mass *= 1.3
    wrong = replace(ROBOT, model=model)
    found = identify(
        wrong, [log], IdentificationOptions(method="base_parameters", terms=PLAIN, held_out=0.0)
    )
    base = base_parameters(ROBOT.model)
    own = np.append(body_parameters(ROBOT.model), ROBOT.drives.rotor_inertia)
    true = dict(zip(base.expressions, (base.combination @ own).tolist(), strict=True))
    values = {each.figure: each for each in found.parameters if each.joint is None}
    errors = [(each.value - true[name]) / each.sd for name, each in values.items()]
    assert len(errors) >= 36 and np.abs(errors).max() < 2 * FAR and np.median(np.abs(errors)) < 1.5
    assert found.structure.excited == found.structure.base == 40
    others = log_of(truth, *fourier(ROBOT.nq, 1, seed=5), 0.1 * SIZES)
    fitted, robots = torque_errors(found.validate([others]))
    assert fitted.rmse == pytest.approx(0.1 * SIZES, rel=0.3)
    assert (fitted.rmse[1:] < 0.5 * robots.rmse[1:]).all()


def test_essential_parameters_are_told_and_the_rest_is_the_robots_own() -> None:
    """Verdonck, Radkhah: without undetermined parameters, the remaining ones are more precise."""
    truth = replace(truth_of(ROBOT), rotor_inertia=ROBOT.drives.rotor_inertia)
    log = log_of(truth, *fourier(ROBOT.nq, 2), 2 * SIZES)
    every, essential = (
        identify(ROBOT, [log], IdentificationOptions(method=method, terms=PLAIN, held_out=0.0))
        for method in ("base_parameters", "essential_parameters")
    )
    left = [each for each in essential.parameters if each.why]
    assert left and all(each.value == each.previous for each in left)
    assert all(each.sd <= 0.3 * abs(each.value) for each in essential.parameters if not each.why)
    before = {(each.figure, each.joint): each.sd for each in every.parameters}
    ratios = [
        each.sd / before[each.figure, each.joint] for each in essential.parameters if not each.why
    ]
    assert np.median(ratios) < 1


def test_the_wrench_beneath_the_arm_is_that_of_its_links() -> None:
    """The force on the first joint, by Pinocchio, is the force of the base on all links."""
    model, (q, v, a) = ROBOT.model, fourier(ROBOT.nq, 1)
    bare = model.copy()
    bare.armature = np.zeros(model.nv)
    data = bare.createData()
    found = base_wrench_regressor(model, q[::50], v[::50], a[::50]) @ body_parameters(model)
    for row, state in zip(found, zip(q[::50], v[::50], a[::50], strict=True), strict=True):
        pin.rnea(bare, data, *state)
        pin.forwardKinematics(bare, data, state[0])
        expected = -data.oMi[1].act(data.f[1]).vector
        assert np.abs(row - expected).max() < ROUNDING * np.abs(expected).max() * 100


def test_links_from_the_wrench_beneath_the_arm() -> None:
    """Christoforou: links heavier than the robot's own are found, however large the friction is."""
    model, (q, v, a) = ROBOT.model, fourier(ROBOT.nq, 4)
    real = model.copy()
    for body in list(real.inertias)[1:]:
        body.mass *= 1.3
    exact = base_wrench_regressor(real, q, v, a) @ body_parameters(real)
    # the sensor has an offset, and carries the base
    noise = np.random.default_rng(2).normal(0.0, 0.1, exact.shape)
    log = log_of(
        truth_of(ROBOT),
        q,
        v,
        a,
        50 * SIZES,
        wrench=exact + noise + np.array([3.0, -2.0, -40.0, 1.0, 0.0, 2.0]),
    )
    found = identify(ROBOT, [log], IdentificationOptions(method="base_wrench", held_out=0.0))
    assert found.physical is not None and found.physical.consistent
    test = [each[::7] for each in fourier(ROBOT.nq, 1, seed=5)]
    body = found.figures().values
    assert body["mass"].sum() == pytest.approx(
        1.3 * sum(each.mass for each in list(model.inertias)[1:]), rel=0.15
    )
    change = np.array([each.value - each.previous for each in found.parameters])
    true, own = (rigid_torques(each, *test) for each in (real, model))
    fitted = own + rigid_regressor(model, *test) @ change
    # joint 1 turns about gravity: its torque depends on inertias alone, fixed by the prior
    off, before = (np.linalg.norm(each - true, axis=0)[1:4] for each in (fitted, own))
    assert (off < 0.1 * before).all()
    assert "coulomb" not in body


@pytest.mark.long
def test_links_from_the_wrench_do_not_depend_on_the_payload() -> None:
    model, (q, v, a) = ROBOT.model, fourier(ROBOT.nq, 2)
    payload = Payload(3.0, np.array([0.0, 0.02, 0.1]))
    loaded = ROBOT.loaded_model(
        payload.mass, payload.com, payload.inertia, np.array([0.0, 0.0, -9.81])
    )
    found = []
    for carried, load in ((model, Payload()), (loaded, payload)):
        wrench = base_wrench_regressor(carried, q, v, a) @ body_parameters(carried)
        log = log_of(truth_of(ROBOT), q, v, a, SIZES, wrench=wrench, payload=load)
        found.append(
            identify(ROBOT, [log], IdentificationOptions(method="base_wrench", held_out=0.0))
            .figures()
            .values["mass"]
        )
    assert found[0] == pytest.approx(found[1], rel=1e-3)


@pytest.mark.long
def test_four_times_the_moves_halve_the_deviations() -> None:
    """Verdonck, Radkhah: the deviation of a parameter depends on its excitation by the log, and the
    interval contains the true value.
    """
    truth = truth_of(ROBOT)
    deviations = []
    for moves in (8, 32):
        log = replace(recorded(ROBOT, truth, moves=moves).log("torque"), power=None)
        found = identify(ROBOT, [log], WITHOUT_SPLIT).parameters
        told = {(each.figure, each.joint): each for each in found if each.identified}
        away = [
            abs(each.value - getattr(truth, each.figure)[each.joint]) / each.sd
            for each in told.values()
        ]
        assert np.mean(np.array(away) < FAR) >= 0.95
        deviations.append({name: each.sd for name, each in told.items()})
    both = deviations[0].keys() & deviations[1].keys()
    ratio = np.median([deviations[0][name] / deviations[1][name] for name in both])
    assert len(both) >= 12 and 1.5 < ratio < 3.5


def test_motor_currents_need_known_links_and_give_torque_constants() -> None:
    """Paes: as asking for the torque constants, of logs of currents alone."""
    truth = truth_of(ROBOT)
    recording = recorded(ROBOT, truth, moves=8)
    found = identify(
        ROBOT, [recording.log()], IdentificationOptions(method="motor_current", held_out=0.0)
    )
    assert "torque_constant" in {each.figure for each in found.parameters}
    with pytest.raises(MethodNotApplicable, match="currents"):
        identify(ROBOT, [recording.log("torque")], IdentificationOptions(method="motor_current"))


def test_electrical_power_does_without_torques() -> None:
    """Liu: the efforts of a log do not count, however wrong they are."""
    log = recorded(ROBOT, truth_of(ROBOT), moves=8).log("torque")
    wrong = replace(log, effort=3 * np.array(log.effort))
    options = IdentificationOptions(method="electrical_power", held_out=0.0)
    one, two = (identify(ROBOT, [each], options).parameters for each in (log, wrong))
    assert "link_mass_scale" in {each.figure for each in one} and one == two
    with pytest.raises(MethodNotApplicable, match="power"):
        identify(ROBOT, [replace(log, power=None)], options)


def test_friction_at_the_reference_temperature() -> None:
    """Hao: a log that begins cold yields the friction at its mean temperature, and smaller
    residuals."""
    truth = replace(truth_of(ROBOT), load=np.zeros(ROBOT.nq), offset=np.zeros(ROBOT.nq))
    log = replace(recorded(ROBOT, truth, moves=24).log("torque"), power=None)
    warm = np.linspace(20.0, 50.0, len(log.time))[:, None] * np.ones(ROBOT.nq)
    friction = truth.coulomb * log.v / np.hypot(log.v, truth.knee) + truth.viscous * log.v
    log = replace(
        log, effort=log.effort + friction * (np.exp(-0.01 * (warm - 35.0)) - 1), temperature=warm
    )
    terms: tuple[Term, ...] = ("coulomb", "viscous", "offset")
    plain, found = (
        identify(ROBOT, [log], IdentificationOptions(method=method, terms=terms, held_out=0.0))
        for method in ("automatic", "temperature")
    )
    for rates in (plain.temperatures, found.temperatures):
        assert (np.abs(rates.k - 0.01) <= FAR * rates.sd).all()
    assert rates.k == pytest.approx([0.01] * ROBOT.nq, abs=0.002)
    for each, before in zip(found.parameters, plain.parameters, strict=True):
        if each.figure == "coulomb" and each.joint is not None and each.joint < 3:
            true = truth.coulomb[each.joint] * np.exp(
                -0.01 * (found.temperatures.reference[each.joint] - 35.0)
            )
            assert each.value == pytest.approx(true, rel=0.03)
            assert each.sd < before.sd
    # over a smaller span, and without temperatures, no rate is found
    cold = replace(log, temperature=35.0 + 0.2 * (warm - 35.0))
    with pytest.raises(MethodNotApplicable, match="6 K"):
        identify(ROBOT, [cold], IdentificationOptions(method="temperature"))
    for each in (cold, replace(log, temperature=None)):
        rates = identify(ROBOT, [each], WITHOUT_SPLIT).temperatures
        assert np.isnan(rates.k).all() and np.isnan(rates.sd).all()
        assert np.isfinite(rates.reference).all() == (each is cold)


def test_figures_above_the_threshold_velocity() -> None:
    """Vuong: friction that rises below a threshold speed does not bias the parameters of higher
    speeds.
    """
    truth, (q, v, a) = truth_of(ROBOT), fourier(ROBOT.nq, 8)
    log = log_of(truth, q, v, a, 0.1 * SIZES)
    slow = 0.8 * truth.coulomb * np.sign(v) * np.maximum(1 - np.abs(v) / 0.3, 0.0)
    log = replace(log, effort=np.array(log.effort) + slow)
    plain, found = (
        identify(ROBOT, [log], IdentificationOptions(method=method, terms=PLAIN, held_out=0.0))
        for method in ("automatic", "threshold_velocity")
    )
    assert plain.thresholds is None and found.thresholds is not None
    assert ((found.thresholds > 0.1) & (found.thresholds < 0.4)).all()
    off = [
        np.mean(
            [
                abs(each.value / truth.coulomb[each.joint] - 1)
                for each in fitted.parameters
                if each.figure == "coulomb" and each.joint is not None
            ]
        )
        for fitted in (plain, found)
    ]
    assert off[1] < 0.05 < off[0]


def stribeck(v: Array, threshold: float, random: np.random.Generator) -> Array:
    """Noisy friction that rises from its Coulomb value below a threshold speed."""
    rise = 3.0 * np.maximum(1 - np.abs(v) / threshold, 0.0) if threshold else 0.0
    return np.asarray(np.sign(v) * (6.0 + rise) + 4.0 * v + 0.2 + random.normal(0.0, 0.2, v.shape))


@pytest.mark.parametrize("true", [0.0, 0.05, 0.1, 0.2])
def test_the_threshold_velocity_of_friction(true: float) -> None:
    """Vuong: the threshold is the speed at which the rise falls below 5 % of Coulomb friction; it
    is 0 without a rise.
    """
    random = np.random.default_rng(3)
    v = np.concatenate([random.uniform(-2, 2, 20_000), random.uniform(-0.3, 0.3, 20_000)])
    found = velocity_threshold(v, stribeck(v, true, random))
    assert 0.6 * true <= found <= 1.2 * true
