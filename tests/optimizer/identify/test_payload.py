"""The payload of an arm from a log without it and one with it, for known true values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    IdentificationOptions,
    InvalidProblem,
    Log,
    NotExcited,
    Payload,
    PayloadUnknown,
    identify,
    load_robot,
)
from joulepath.optimizer.identify.fits.payload_fit import IdentifiedPayload
from tests.identification_logs import FAR, Noise, recorded, torque_errors, truth_of
from tests.selection import long_but

ROBOT = load_robot("ur10e")
PAYLOAD = Payload(2.805, np.array([0.01, -0.02, 0.06]), np.diag([0.006, 0.006, 0.004]))
NOTHING = Payload()
ASKED = IdentificationOptions(fit=("payload",), held_out=0.0)
NOISE = Noise(current=0.1)


def log_of(carried: Payload, seed: int, said: Payload, motions: int = 0) -> Log:
    """A log of a unit with other friction than the robot's own; the stated payload may differ from
    the carried one.
    """
    truth = replace(truth_of(ROBOT, seed), payload=carried)
    log = recorded(ROBOT, truth, moves=12, seed=motions, noise=NOISE).log()
    return replace(log, power=None, payload=said)


def found_in(*logs: Log, options: IdentificationOptions = ASKED) -> IdentifiedPayload:
    found = identify(ROBOT, logs, options).payload
    assert found is not None
    return found


def check(carried: IdentifiedPayload, mass: float = PAYLOAD.mass) -> None:
    sd = np.sqrt(np.diag(carried.covariance))
    assert not carried.why
    assert abs(carried.mass - mass) <= min(0.015 * mass, FAR * sd[0])
    assert 0 < sd[0] <= 0.02
    assert (np.abs(carried.com - PAYLOAD.com) <= FAR * sd[1:]).all() and sd[1:].max() < 0.005


@pytest.mark.parametrize("seed", long_but([0], [0, 1]))
def test_mass_and_centre_of_mass_are_found(seed: int) -> None:
    """The motions differ from the motions of the log without the payload."""
    check(found_in(log_of(NOTHING, seed, NOTHING, seed), log_of(PAYLOAD, seed, PAYLOAD, seed + 50)))


def test_errors_of_the_links_do_not_become_payload() -> None:
    """The true link masses differ from the robot's figures by up to 5 %."""
    scale = np.array([1.05, 0.95, 1.04, 0.96, 1.05, 0.95])
    model = ROBOT.loaded_model(
        0.0, np.zeros(3), np.zeros((3, 3)), np.array([0.0, 0.0, -9.81]), scale
    )
    logs = [log_of(NOTHING, 2, NOTHING), log_of(PAYLOAD, 2, PAYLOAD, 52)]
    found = identify(replace(ROBOT, model=model), logs, ASKED).payload
    assert found is not None
    check(found)


@pytest.mark.long
def test_torque_constants_that_differ_make_the_mass_less_certain() -> None:
    """The true motor torques differ from the robot's figures by up to 4 %."""
    wrong = np.array([1.0, 1.04, 0.97, 1.03, 1.0, 1.0])
    off, certain = (
        list[float](),
        found_in(log_of(NOTHING, 0, NOTHING), log_of(PAYLOAD, 0, NOTHING, 50)),
    )
    for seed in range(2):
        logs = [log_of(NOTHING, seed, NOTHING, seed), log_of(PAYLOAD, seed, NOTHING, seed + 50)]
        logs = [replace(log, effort=np.asarray(log.effort) * wrong) for log in logs]
        carried = found_in(*logs)
        sd = float(np.sqrt(carried.covariance[0, 0]))
        assert sd > 2 * np.sqrt(certain.covariance[0, 0])
        off.append((carried.mass - PAYLOAD.mass) / sd)
    assert np.sqrt(np.mean(np.square(off))) < 2


@pytest.mark.long
def test_what_the_log_says_of_its_payload_does_not_count() -> None:
    without, logs = (
        log_of(NOTHING, 0, NOTHING),
        [log_of(PAYLOAD, 0, said, 50) for said in (NOTHING, Payload(9.0))],
    )
    assert found_in(without, logs[0]).mass == found_in(without, logs[1]).mass


@pytest.mark.long
def test_the_other_log_may_carry_something_that_is_known() -> None:
    half = Payload(1.5, np.array([0.0, 0.0, 0.03]))
    check(found_in(log_of(half, 1, half), log_of(PAYLOAD, 1, NOTHING, 50)))


def test_a_payload_needs_two_logs_that_differ_by_it() -> None:
    without, loaded = log_of(NOTHING, 0, NOTHING), log_of(PAYLOAD, 0, NOTHING, 50)
    with pytest.raises(InvalidProblem, match="kg less in the last log"):
        found_in(loaded, without)
    with pytest.raises(InvalidProblem, match="two logs"):
        found_in(loaded)
    alike = [turned(log_of(NOTHING, 0, NOTHING, motions)) for motions in (0, 9)]
    with pytest.raises(NotExcited) as caught:
        found_in(*alike)
    assert caught.value.parameters[0] == "payload_mass"
    assert caught.value.advice["parameters"] == ["inertials", "rotor", "friction"]


def turned(log: Log) -> Log:
    """The log of an arm turning about its upright axis alone, without any torque of weight."""
    first = np.arange(ROBOT.nq) == 0
    motion = {name: np.where(first, getattr(log, name), 0.0) for name in ("q", "v", "a")}
    return replace(log, **motion, effort=np.where(first, np.asarray(log.effort), 0.01))


@pytest.mark.long
@pytest.mark.parametrize("seed", long_but([0], [0, 1]))
def test_nothing_carried_is_found_with_its_deviation(seed: int) -> None:
    """Either log may state a payload; the flange of the examined log is empty."""
    without = log_of(NOTHING, seed, NOTHING)
    pairs = (
        [without, log_of(NOTHING, seed, PAYLOAD, 9)],
        [log_of(PAYLOAD, seed, PAYLOAD, 50), without],
    )
    for logs in pairs:
        found = identify(ROBOT, logs, ASKED)
        carried = found.payload
        assert carried is not None and not carried.why and not carried.body.any()
        sd = float(np.sqrt(carried.covariance[0, 0]))
        assert 0 <= carried.mass <= FAR * sd and 0 < sd <= 0.03
        told = {each.figure: each.identified for each in found.parameters}
        assert told["payload_mass"] and not told["payload_com_x"] and told["coulomb"]


def test_a_payload_that_is_not_told_is_none_and_the_rest_is_found() -> None:
    logs = [turned(log_of(NOTHING, 0, NOTHING, motions)) for motions in (0, 9)]
    found = identify(ROBOT, logs, IdentificationOptions(fit=("friction", "payload"), held_out=0.0))
    told = {each.figure for each in found.parameters if each.identified}
    assert "coulomb" in told and not any(each.startswith("payload") for each in told)
    assert found.payload is not None and found.payload.mass == 0 and found.payload.why


@pytest.mark.long
def test_held_out_motions_are_predicted_with_the_payload() -> None:
    """Without the fitted payload, the torque errors of the held-out motions are far larger."""
    logs = [log_of(NOTHING, 0, NOTHING), log_of(PAYLOAD, 0, NOTHING, 50)]
    better, worse = (
        torque_errors(identify(ROBOT, logs, IdentificationOptions(fit=each)).validation)[0]
        for each in (("payload",), ("friction", "rotor"))
    )
    assert (better.rmse[1:4] < 0.5 * worse.rmse[1:4]).all()


def test_torque_constants_need_a_payload_that_is_known() -> None:
    constants = IdentificationOptions(fit=("friction", "torque_constant"), held_out=0.0)
    log = log_of(NOTHING, 0, NOTHING)
    assert identify(ROBOT, [log], constants).parameters
    for logs, options in (
        ([replace(log, payload_known=False)], constants),
        ([log, log], IdentificationOptions(fit=("torque_constant", "payload"), held_out=0.0)),
    ):
        with pytest.raises(PayloadUnknown) as caught:
            identify(ROBOT, logs, options)
        # gravity exerts no torque on the first and the last joint
        assert {0, 5} <= set(caught.value.joints) and not {1, 2} & set(caught.value.joints)


def test_a_payload_is_not_found_together_with_links() -> None:
    log = log_of(NOTHING, 0, NOTHING)
    with pytest.raises(InvalidProblem, match="links that are known"):
        identify(ROBOT, [log, log], IdentificationOptions(fit=("payload",), refit=True))
