"""Torques measured at the motors or behind the gears, of arms with known parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    Arm,
    IdentificationOptions,
    InvalidProblem,
    Log,
    LogOptions,
    MethodNotApplicable,
    Robot,
    identify,
    load_robot,
    read_log,
)
from joulepath.models.robot import Array
from joulepath.optimizer.identify.logs.recorded import measured
from joulepath.optimizer.identify.rows.fit_rows import ROWS
from tests.identification_logs import (
    GRAVITY,
    SILENT,
    WITHOUT_SPLIT,
    Recording,
    Truth,
    csv_of,
    power_errors,
    recorded,
    rigid_torques,
    torque_errors,
    truth_of,
)
from tests.refusals import refusal_of
from tests.selection import long_but

PANDA = load_robot("panda")
# N·m of the bearings and the reading at rest of torque sensors behind the gears
BEARING, OFFSET = 0.3, 0.4
# % of the energy of a move, from six moves without noise: the power of four moves determines the
# friction of the drives, invisible to torques behind the gears
NOISE_FREE = 5.0
# mass of the links over the robot's own
HEAVIER = 1.1


def behind_the_gears(
    robot: Robot, truth: Truth, recording: Recording, gain: Array | float = 0.0
) -> Log:
    """The recording with torques of sensors behind the gears, with relative errors `gain` (nq,)."""
    random, noise = np.random.default_rng(0), 0.02
    rigid = rigid_torques(robot, truth, recording.q, recording.v, recording.a)
    seen = (1 + gain) * rigid + BEARING * np.tanh(recording.v / 0.01) + OFFSET
    log = replace(recording, torque=seen + random.normal(0, noise, seen.shape)).log("torque")
    return replace(log, torque_side="link", power=None)


@pytest.fixture(scope="module")
def heavier() -> tuple[Robot, Log]:
    """A Panda with links a tenth heavier than the robot's own, and its log."""
    none = np.zeros((3, 3))
    scale = np.full(PANDA.nq, HEAVIER)
    real = replace(PANDA, model=PANDA.loaded_model(0.0, none[0], none, GRAVITY, scale))
    truth = truth_of(PANDA)
    # the sensor of joint 4 reads too much
    gain = np.where(np.arange(PANDA.nq) == 3, 0.05, 0.0)
    return real, behind_the_gears(real, truth, recorded(real, truth, moves=14), gain)


def test_torques_behind_the_gears_identify_links_and_keep_the_drives(
    heavier: tuple[Robot, Log],
) -> None:
    real, log = heavier
    found = identify(PANDA, [log], IdentificationOptions())
    assert not found.warnings
    by_name = {(each.figure, each.joint): each for each in found.parameters}
    for joint in range(PANDA.nq):
        for figure in ("coulomb", "viscous", "rotor_inertia"):
            kept = by_name[figure, joint]
            assert not kept.identified and "behind the gears" in kept.why
            assert kept.value == kept.previous
    offsets = [by_name["offset", joint].value for joint in (1, 3)]
    assert offsets == pytest.approx([OFFSET] * 2, abs=0.1)
    (fitted, own), loaded = torque_errors(found.validation), [1, 3]
    assert (fitted.rmse[loaded] < 0.1 * own.rmse[loaded]).all()
    assert np.isnan(fitted.copper_energy)

    document = found.document("2026-01-31")
    assert "drives" not in document and "friction_laws" not in document
    assert document["inertials"]["mass"]["trust"] == "B"
    written = load_robot("panda", figures=document)
    assert written.friction.name == PANDA.friction.name
    q = np.random.default_rng(3).uniform(-1, 1, (5, PANDA.nq))
    still = np.zeros_like(q)
    truth = truth_of(PANDA)
    weight = rigid_torques(real, truth, q, still, still)
    near = rigid_torques(written, truth, q, still, still)
    robots = rigid_torques(PANDA, truth, q, still, still)
    assert np.abs(near - weight).max() < 0.15 * np.abs(robots - weight).max()


@pytest.mark.long
def test_gains_of_sensors_are_not_taken_for_links() -> None:
    truth, gain = truth_of(PANDA), np.array([0.0, 0.0, 0.0, 0.08, 0.0, -0.06, 0.0])
    log = behind_the_gears(PANDA, truth, recorded(PANDA, truth, moves=14), gain)
    found = identify(PANDA, [log])
    gains = [each for each in found.parameters if each.figure == "sensor_gain"]
    for each, real in zip(gains, gain.tolist(), strict=True):
        assert each.value == pytest.approx(real, abs=3 * each.sd)
    # the other joints determine a gain of 8 % with a deviation of at most 1.5 %
    assert gains[3].sd < 0.015
    friction = [each.value for each in found.parameters if each.figure == "sensor_coulomb"]
    assert friction == pytest.approx([BEARING] * PANDA.nq, rel=0.05)
    # a fit without gains leaves some per cent of the torque of joints 4 and 6
    fitted, own = torque_errors(found.validation)
    assert (fitted.rmse < 0.1 * own.rmse)[[3, 5]].all()


@pytest.mark.parametrize("distance", long_but([2e-3], [1e-5, 2e-3]))
def test_friction_of_bearings_reverses_over_the_distance_of_the_log(distance: float) -> None:
    truth = truth_of(PANDA, 2)
    recording = recorded(PANDA, truth, moves=14, seed=2)
    drag = np.zeros_like(recording.q)
    for row, step in enumerate(np.diff(recording.exact_q, axis=0), 1):
        forward = np.sign(step)
        drag[row] = forward + (drag[row - 1] - forward) * np.exp(-np.abs(step) / distance)
    seen = rigid_torques(PANDA, truth, recording.q, recording.v, recording.a) + BEARING * drag
    log = replace(recording, torque=seen).log("torque")
    log = replace(log, torque_side="link", power=None)
    sensor = identify(PANDA, [log], WITHOUT_SPLIT).fitted.arm.sensor
    assert sensor is not None and ROWS.reversals[sensor.reversal] == distance
    assert sensor.sensor_coulomb == pytest.approx([BEARING] * PANDA.nq, rel=0.05)


@pytest.mark.long
def test_advice_asks_for_what_the_links_do_not_tell(heavier: tuple[Robot, Log]) -> None:
    advice = identify(PANDA, [heavier[1]], WITHOUT_SPLIT).advice
    assert advice is not None and advice.figure in ("idle_power", "coulomb", "copper")
    assert 0 < advice.share <= 1 and "power" in advice.do


@pytest.mark.long
def test_power_tells_the_friction_that_torques_behind_the_gears_do_not() -> None:
    truth = truth_of(PANDA, 3)
    recording = recorded(PANDA, truth, moves=14, seed=3)
    log = replace(behind_the_gears(PANDA, truth, recording), power=recording.log().power)
    found = identify(PANDA, [log])
    names = {each.figure for each in found.parameters if each.identified}
    assert "coulomb" in names and "link_mass_scale" not in names
    fitted, own = power_errors(found.validation)
    assert fitted.energy_mean < 0.5 * own.energy_mean


def test_torques_of_the_same_robots_motors_identify_its_friction() -> None:
    truth = truth_of(PANDA, 1)
    log = replace(recorded(PANDA, truth, moves=14, seed=1).log("torque"), power=None)
    found = identify(PANDA, [log], WITHOUT_SPLIT)
    coulomb = [each for each in found.parameters if each.figure == "coulomb"]
    assert all(each.identified for each in coulomb)
    for each in coulomb:
        assert each.joint is not None
        assert each.value == pytest.approx(truth.coulomb[each.joint], rel=0.1)


def test_torques_of_motors_are_told_from_those_behind_the_gears() -> None:
    log = replace(recorded(PANDA, truth_of(PANDA, 1), moves=4).log("torque"), power=None)
    found = identify(PANDA, [replace(log, torque_side="link")], WITHOUT_SPLIT)
    told = [each for each in found.warnings if "those of the motors" in each]
    assert len(told) == PANDA.nq and all("torque_side" in each for each in told)


def test_keeping_the_links_or_asking_for_friction_is_refused_with_the_cause(
    heavier: tuple[Robot, Log],
) -> None:
    log = heavier[1]
    with refusal_of("inertials", match="behind the gears"):
        identify(PANDA, [log], replace(WITHOUT_SPLIT, refit=False))
    with pytest.raises(MethodNotApplicable, match="behind the gears"):
        identify(PANDA, [log], replace(WITHOUT_SPLIT, method="threshold_velocity"))
    with pytest.raises(InvalidProblem, match="same side"):
        identify(PANDA, [log, replace(log, torque_side="motor")], WITHOUT_SPLIT)
    with pytest.raises(InvalidProblem, match="Currents"):
        replace(log, effort_meaning="current")


@pytest.mark.parametrize(
    "method", long_but(["base_parameters"], ["base_parameters", "essential_parameters"])
)
def test_base_parameters_behind_the_gears_have_no_rotors(
    heavier: tuple[Robot, Log], method: str
) -> None:
    options = replace(WITHOUT_SPLIT, method=method)
    found = identify(PANDA, [heavier[1]], options)
    assert found.structure.base == 43
    assert not any("Ia" in each.figure for each in found.parameters)
    document = found.document("2026-01-31")
    assert "friction_laws" not in document and "drives" not in document


def test_the_reader_takes_the_side_of_the_robots_limits_or_as_told() -> None:
    truth = truth_of(PANDA)
    recording = recorded(PANDA, truth, moves=3, noise=SILENT)
    body = csv_of(recording, effort="torque", without="P")
    assert read_log(body, PANDA, LogOptions(effort="torque")).log.torque_side == "link"
    told = read_log(body, PANDA, LogOptions(effort="torque", torque_side="motor"))
    assert told.log.torque_side == "motor" and told.report.effort is not None
    assert told.report.effort.torque_side == "motor"
    currents = csv_of(recording, effort="current", without="P")
    assert read_log(currents, PANDA, LogOptions(effort="current")).log.torque_side == "motor"


def test_measured_energy_is_the_same_from_either_side() -> None:
    """The arm has the robot's own friction and rotors, which are invisible to sensors behind the
    gears.
    """
    truth = replace(
        truth_of(PANDA),
        coulomb=PANDA.friction.coulomb,
        viscous=PANDA.friction.viscous,
        load=np.zeros(PANDA.nq),
        offset=np.zeros(PANDA.nq),
        rotor_inertia=PANDA.drives.rotor_inertia,
    )
    recording = recorded(PANDA, truth, moves=2, noise=SILENT)
    motor = recording.log("torque")
    rigid = rigid_torques(PANDA, truth, recording.q, recording.v, recording.a)
    link = replace(motor, effort=rigid, torque_side="link")
    arm = Arm(robot=PANDA)
    one, other = (
        sum(each.by_efforts or 0.0 for each in measured(log, arm)) for log in (motor, link)
    )
    assert other == pytest.approx(one, rel=1e-9)
    assert one > 1.1 * sum(
        each.by_efforts or 0.0 for each in measured(replace(link, torque_side="motor"), arm)
    )


def test_torques_behind_the_gears_without_noise_predict_energies() -> None:
    """The priors alone separate the gains of the sensors from the masses of the links."""
    robot = load_robot("ur10e")
    truth = truth_of(robot, 3)
    silent = recorded(robot, truth, moves=6, seed=3, noise=SILENT)
    torque = rigid_torques(robot, truth, silent.exact_q, silent.exact_v, silent.a)
    log = replace(silent.log("torque"), effort=torque, torque_side="link")
    assert power_errors(identify(robot, [log]).validation)[0].energy_mean < NOISE_FREE
