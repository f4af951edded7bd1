"""The methods of the literature by name, each where the truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.registry import load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.energy.link_regressor import body_parameters, rigid_regressor, rigid_torques
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.arm.base_parameters import base_parameters
from joulepath.optimizer.identify.fits.base_wrench import base_wrench_regressor, fit_base_wrench
from joulepath.optimizer.identify.fits.periodic import mean_period, most_likely
from joulepath.optimizer.identify.fits.threshold import velocity_threshold
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.options import IdentificationOptions
from tests.identification_logs import recorded, truth_of

ROBOT = load_robot("ur5e")
# of the standard deviations: what one of a thousand figures exceeds
FAR = 4.0
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


def test_maximum_likelihood_from_a_periodic_excitation() -> None:
    """Swevers: joints with noise of different size are weighted by it, and the covariance holds."""
    model = ROBOT.model
    base = base_parameters(model, rotors=False)
    q, v, a = fourier(ROBOT.nq, 8)
    regressor = rigid_regressor(model, q, v, a)[:, :, base.independent]
    truth = base.combination @ body_parameters(model)
    sizes = np.array([2.0, 2.0, 1.0, 0.2, 0.2, 0.1])
    noise = np.random.default_rng(1).normal(0.0, 1.0, (len(q), ROBOT.nq)) * sizes
    samples = round(PERIOD * RATE)
    measured = mean_period(rigid_torques(model, q, v, a) + noise, samples)
    assert np.sqrt(measured.variance) == pytest.approx(sizes, rel=0.05)
    found = most_likely(regressor[:samples], measured)
    error = found.value - truth
    assert (np.abs(error) < FAR * np.sqrt(np.diag(found.covariance))).all()
    # of 36 figures, the square of the error by its covariance is 36, give or take 8.5
    assert 15 < error @ np.linalg.solve(found.covariance, error) < 60
    assert found.excess == pytest.approx(1.0, abs=0.1)
    # a model that misses something is told by it
    wrong = replace(measured, mean=measured.mean + 0.5 * np.sign(v[:samples]))
    assert most_likely(regressor[:samples], wrong).excess > 2


def test_a_log_without_two_periods_is_refused() -> None:
    with pytest.raises(InvalidProblem, match="2"):
        mean_period(np.zeros((750, 6)), 500)


def test_the_wrench_beneath_the_arm_is_that_of_its_links() -> None:
    """By Pinocchio: the force that the first joint takes is what the base exerts on all links."""
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


def test_base_parameters_from_the_wrench_beneath_the_arm() -> None:
    """Christoforou: no friction is in it, however great that is."""
    model, (q, v, a) = ROBOT.model, fourier(ROBOT.nq, 4)
    random = np.random.default_rng(2)
    exact = base_wrench_regressor(model, q, v, a) @ body_parameters(model)
    wrench = exact + random.normal(0.0, 1.0, exact.shape) * np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])
    found = fit_base_wrench(model, q, v, a, wrench, np.arange(len(q)) // 100)
    truth = found.combination @ body_parameters(model)
    z = (found.value - truth) / np.sqrt(np.diag(found.covariance))
    assert np.abs(z).max() < FAR
    # the wrench tells more combinations than the torques do
    assert len(truth) > base_parameters(model, rotors=False).count


def test_four_times_the_moves_halve_the_deviations() -> None:
    """Verdonck, Radkhah: what a log tells of a figure goes by how it excites it; and the truth is within it."""
    truth = truth_of(ROBOT)
    deviations = []
    for moves in (8, 32):
        log = replace(recorded(ROBOT, truth, moves=moves).log("torque"), power=None)
        found = identify(ROBOT, [log], IdentificationOptions(held_out=0.0)).parameters
        told = {(each.figure, each.joint): each for each in found if each.identified}
        away = [abs(each.value - getattr(truth, each.figure)[each.joint]) / each.sd for each in told.values()]
        assert np.mean(np.array(away) < FAR) >= 0.95
        deviations.append({name: each.sd for name, each in told.items()})
    both = deviations[0].keys() & deviations[1].keys()
    ratio = np.median([deviations[0][name] / deviations[1][name] for name in both])
    assert len(both) >= 12 and 1.5 < ratio < 3.5


def stribeck(v: Array, threshold: float, random: np.random.Generator) -> Array:
    """Friction that rises from its Coulomb value below a speed, with noise."""
    rise = 3.0 * np.maximum(1 - np.abs(v) / threshold, 0.0) if threshold else 0.0
    return np.asarray(np.sign(v) * (6.0 + rise) + 4.0 * v + 0.2 + random.normal(0.0, 0.2, v.shape))


@pytest.mark.parametrize("true", [0.05, 0.1, 0.2])
def test_the_threshold_velocity_of_friction(true: float) -> None:
    """Vuong: where the rise is no longer seen above 5 % of Coulomb friction."""
    random = np.random.default_rng(3)
    v = np.concatenate([random.uniform(-2, 2, 20_000), random.uniform(-0.3, 0.3, 20_000)])
    found = velocity_threshold(v, stribeck(v, true, random))
    assert 0.6 * true < found < 1.2 * true


def test_friction_without_a_rise_has_no_threshold() -> None:
    random = np.random.default_rng(4)
    v = np.concatenate([random.uniform(-2, 2, 20_000), random.uniform(-0.3, 0.3, 20_000)])
    assert velocity_threshold(v, stribeck(v, 0.0, random)) == 0.0
