"""evaluate(arm, motion) against Pinocchio and against formulas written here once more."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from itertools import chain, pairwise, repeat
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    Bus,
    DeadlineExceeded,
    Evaluation,
    InvalidProblem,
    InvalidTable,
    RecordedRows,
    Recording,
    Waypoints,
    evaluate,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.motion.time_scalings import quintic
from tests.by_pinocchio import torques_of
from tests.optimizer.moves import GOAL, PAYLOAD, ROBOT, START, TILTED, limits, problem

VIA = START + np.array([-0.4, 0.3, 0.5, -0.6, 0.8, 0.2])
POINTS = np.array([START, VIA, GOAL])
TIMES = np.array([1.1, 1.7])
ARM = Arm(robot=ROBOT, payload=PAYLOAD, gravity=TILTED)
INTERPOLATIONS = ("linear", "trapezoid", "quintic", "spline")
# of the trapezoidal rule on a grid of 0.5 ms, with jumps of friction and acceleration between two
# samples
QUADRATURE = 5e-4
# of one dynamics against the other [N·m]
DYNAMICS = 1e-9


def motion(interpolation: Any) -> Waypoints:
    return Waypoints(POINTS, TIMES, interpolation)


def log(rows: int, period: float = 0.008) -> tuple[Array, Array]:
    t = np.arange(rows) * period
    return t, START + 0.3 * np.sin(t[:, None] * np.linspace(0.2, 0.7, 6))


def total(result: Evaluation) -> float:
    return result.total.energy.electrical.total


def simple_power(arm: Arm, v: Array, tau: Array) -> Array:
    """Power drawn (k,) [W], from the design's formulas alone."""
    motor = tau + ROBOT.friction.torque(v)
    current = motor / ROBOT.drives.torque_constant
    net = ROBOT.electronics.idle_power + (motor * v + ROBOT.drives.copper * current**2).sum(axis=1)
    return np.maximum(net, 0.0)


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_agrees_with_pinocchio(interpolation: str) -> None:
    result = evaluate(ARM, motion(interpolation), sample_period=5e-4)
    s = result.samples
    assert s is not None
    tau = torques_of(rigid_body_model(ARM), s.q, s.v, s.a)
    assert np.abs(s.tau - tau).max() < DYNAMICS
    power = simple_power(ARM, s.v, tau)
    assert s.power == pytest.approx(power, rel=1e-9)
    mechanical = np.abs(tau * s.v).sum(axis=1)
    for values, ours in (
        (power, total(result)),
        (mechanical, result.total.energy.mechanical.total),
    ):
        # segments are integrated separately: at a jump the sample belongs to the later side
        cut = round(TIMES[0] / 5e-4)
        parts = [values[:cut], values[cut:]]
        sums = [np.trapezoid(part, dx=5e-4) for part in parts]
        missing = values[cut - 1] * 5e-4  # from the last sample before the jump to the jump
        assert sum(sums) + missing == pytest.approx(ours, rel=QUADRATURE)


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_parts_add_up_and_segments_to_the_total(interpolation: str) -> None:
    result = evaluate(ARM, motion(interpolation))
    for interval in (result.total, *result.segments):
        assert interval.balance_error < 1e-6
    assert sum(each.energy.electrical.total for each in result.segments) == pytest.approx(
        total(result)
    )
    assert [each.end for each in result.segments] == pytest.approx(np.cumsum(TIMES).tolist())
    assert result.total.mean_mechanical_power == pytest.approx(
        result.total.energy.mechanical.total / TIMES.sum()
    )


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_goes_through_the_configurations(interpolation: str) -> None:
    s = evaluate(ARM, motion(interpolation), sample_period=1e-3).samples
    assert s is not None
    at = np.searchsorted(s.t, np.append(0.0, np.cumsum(TIMES)) - 1e-9)
    assert np.abs(s.q[at] - POINTS).max() < 1e-9
    # v and a are derivatives, away from jumps
    smooth = np.abs(np.diff(s.a, axis=0)).max(axis=1) < 0.5
    slope = np.diff(s.q, axis=0) / np.diff(s.t)[:, None]
    middle = (s.v[1:] + s.v[:-1]) / 2
    inside = smooth & (np.abs(np.diff(s.v, axis=0)).max(axis=1) < 0.05)
    assert inside.mean() > 0.99
    assert np.abs(slope - middle)[inside].max() < 1e-4
    if interpolation != "linear":
        assert np.abs(s.v[[0, -1]]).max() < 1e-9
    if interpolation in ("quintic", "spline"):
        assert np.abs(s.a[[0, -1]]).max() < 1e-9


def test_is_the_baselines_own_quintic() -> None:
    result = evaluate(ARM, Waypoints(np.array([START, GOAL]), np.array(1.6), "quintic"))
    known = quintic(START, GOAL, 1.6)
    tau = Plant(ARM).torques(known.q, known.v, known.a)
    assert total(result) == pytest.approx(
        float(known.weights @ simple_power(ARM, known.v, tau)), rel=1e-4
    )
    peaks = {report.limit: report.worst_ratio for report in result.limits}
    assert peaks["velocity"] == pytest.approx((known.peak_v / ROBOT.limits.v_max).max(), rel=1e-5)
    assert peaks["acceleration"] == pytest.approx(
        (known.peak_a / ROBOT.limits.a_max).max(), rel=1e-5
    )
    assert peaks["jerk"] == pytest.approx((known.peak_jerk / ROBOT.limits.j_max).max(), rel=1e-5)


def test_a_velocity_step_violates_acceleration_and_needs_no_energy() -> None:
    result = evaluate(ARM, motion("linear"))
    assert result.speed_jumps == 1
    reports = {report.limit: report for report in result.limits}
    assert not reports["acceleration"].held and not reports["jerk"].held
    assert reports["acceleration"].t == reports["jerk"].t == pytest.approx(TIMES[0])
    assert reports["velocity"].held and reports["torque"].held
    # kinetic energy is the change within the segments, at constant joint speed, without the jumps
    # between them
    parts = [each.kinetic_end - each.kinetic_start for each in result.segments]
    assert result.total.energy.electrical.kinetic == pytest.approx(sum(parts))
    assert result.segments[0].kinetic_end != pytest.approx(
        result.segments[1].kinetic_start, rel=1e-3
    )


def test_a_trapezoid_violates_jerk_only() -> None:
    result = evaluate(ARM, motion("trapezoid"))
    assert {report.limit for report in result.limits if not report.held} == {"jerk"}
    relaxed = Arm(robot=ROBOT, payload=PAYLOAD, gravity=TILTED, limits=limits(v_max=0.3))
    broken = {
        report.limit: report
        for report in evaluate(relaxed, motion("trapezoid")).limits
        if not report.held
    }
    assert broken["velocity"].bound == 0.3
    assert abs(broken["velocity"].value) == pytest.approx(0.3 * broken["velocity"].worst_ratio)


def test_a_log_of_a_motion_needs_the_energy_of_the_motion() -> None:
    whole = evaluate(ARM, motion("spline"), sample_period=2e-3)
    s = whole.samples
    assert s is not None
    by_q = evaluate(ARM, Recording.of(s.t, s.q))
    by_all = evaluate(ARM, Recording.of(s.t, s.q, s.v, s.a))
    for result in (by_q, by_all):
        # splines through samples 2 ms apart
        assert total(result) == pytest.approx(total(whole), rel=1e-4)
        assert result.total.balance_error < 1e-4


def test_speeds_that_do_not_fit_show_in_the_balance() -> None:
    t, q = log(500)
    v = np.gradient(q, t, axis=0)
    assert evaluate(ARM, Recording.of(t, q, v)).total.balance_error < 1e-3
    assert evaluate(ARM, Recording.of(t, q, 1.5 * v)).total.balance_error > 1e-3


def test_blocks_do_not_show() -> None:
    t, q = log(2 * MOTION_LIMITS.block_rows + 700)
    whole = evaluate(ARM, Recording([RecordedRows(t, q)]), sample_period=0.05)
    for size in (50, 977, MOTION_LIMITS.block_rows + 3):
        parts = [RecordedRows(t[k : k + size], q[k : k + size]) for k in range(0, len(t), size)]
        result = evaluate(ARM, Recording(parts), sample_period=0.05)
        # the spline through a block and its neighbouring rows is the spline through all rows,
        # except for rounding
        assert total(result) == pytest.approx(total(whole), rel=1e-9)
        assert result.samples is not None and whole.samples is not None
        assert np.abs(result.samples.a - whole.samples.a).max() < 1e-7


def test_the_start_of_time_does_not_matter() -> None:
    t, q = log(300)
    shifted = evaluate(ARM, Recording.of(t + 1.7e6, q))
    assert total(shifted) == pytest.approx(total(evaluate(ARM, Recording.of(t, q))), rel=1e-6)
    assert (shifted.total.start, shifted.total.end) == (0.0, pytest.approx(t[-1]))


@pytest.mark.long
def test_memory_does_not_grow_with_the_log() -> None:
    def blocks(count: int) -> Iterator[RecordedRows]:
        for k in range(count):
            t = (k * MOTION_LIMITS.block_rows + np.arange(MOTION_LIMITS.block_rows)) * 0.008
            yield RecordedRows(t, START + 0.3 * np.sin(t[:, None] * np.linspace(0.2, 0.7, 6)))

    def peak(count: int) -> int:
        tracemalloc.start()
        try:
            evaluate(ARM, Recording(blocks(count)))
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(3)  # compiled functions and caches
    assert peak(24) < 1.2 * peak(4)


def test_energy_storage_keeps_its_charge_from_segment_to_segment() -> None:
    bus = Bus("storage", efficiency=0.9, capacity=50.0, power=400.0, initial=5.0)
    arm = Arm(robot=ROBOT, payload=PAYLOAD, bus=bus)
    points = np.array([START, GOAL] * 6)
    result = evaluate(arm, Waypoints(points, np.array(0.7), "quintic"), sample_period=0.01)
    uses = [each.energy.storage for each in result.segments]
    assert uses[0] is not None and uses[0].initial == 5.0
    for before, after in pairwise(uses):
        assert before is not None and after is not None
        assert after.initial == pytest.approx(before.final)
    use = result.total.energy.storage
    assert use is not None and use.final == uses[-1].final  # type: ignore[union-attr]
    assert use.charged == pytest.approx(sum(each.charged for each in uses if each is not None))
    assert use.charged > 0
    assert result.total.balance_error < 1e-6
    assert result.samples is not None and result.samples.charge is not None
    assert result.samples.charge[-1] == pytest.approx(use.final)


def test_without_a_store_there_is_no_charge() -> None:
    """The charge is absent, as in an answer of `optimize`."""
    samples = evaluate(ARM, motion("quintic"), sample_period=0.01).samples
    assert samples is not None and samples.charge is None
    assert optimize(problem()).trajectory.charge is None


def test_too_many_segments_to_list_are_still_counted() -> None:
    steps = MOTION_LIMITS.max_segments + 5
    q = START + np.linspace(0.0, 1.0, steps + 1)[:, None] * np.ones(6)
    result = evaluate(ARM, Waypoints(q, np.array(1e-3), "linear"))
    assert (result.segment_count, result.segments) == (steps, [])
    whole = evaluate(ARM, Waypoints(q[[0, -1]], np.array(steps * 1e-3), "linear"))
    assert total(result) == pytest.approx(total(whole), rel=1e-6)
    assert result.total.balance_error < 1e-6


@pytest.mark.parametrize(
    "make",
    [
        lambda: Waypoints(POINTS[:1], np.array(1.0)),
        lambda: Waypoints(POINTS, np.array([1.0])),
        lambda: Waypoints(POINTS, np.array([1.0, 0.0])),
        lambda: Waypoints(np.full((3, 6), np.nan), np.array(1.0)),
        lambda: Waypoints(np.zeros((10_001, 6)), np.array(1.0), "spline"),
        lambda: evaluate(ARM, Waypoints(np.zeros((3, 5)), np.array(1.0))),
        lambda: evaluate(ARM, motion("quintic"), sample_period=1e-6),
    ],
)
def test_refuses(make: Any) -> None:
    with pytest.raises((InvalidProblem, InvalidTable)):
        make()


@pytest.mark.parametrize("rows", [0, 1])
def test_refuses_a_log_without_a_motion(rows: int) -> None:
    t, q = log(rows)
    with pytest.raises(InvalidTable):
        evaluate(ARM, Recording.of(t, q))


def test_keeps_its_deadline() -> None:
    def at(first: float, later: float) -> Any:
        return chain([first], repeat(later)).__next__

    # the clock is read at the start, before every block and within it
    assert evaluate(ARM, motion("quintic"), deadline=2.0, clock=at(10.0, 11.9)).segment_count == 2
    with pytest.raises(DeadlineExceeded):
        evaluate(ARM, motion("quintic"), deadline=2.0, clock=at(10.0, 12.1))


@pytest.mark.parametrize(
    "given",
    [
        lambda: evaluate(ARM, START),
        lambda: evaluate(ARM, ([0.0, 1.0], [START, GOAL])),
        lambda: evaluate(ARM, Recording(np.array([0.0, 1.0]), np.array([START, GOAL]))),
    ],
)
def test_arrays_that_are_no_motion_name_the_constructor(given: Any) -> None:
    with pytest.raises(InvalidProblem, match=r"Recording\.of\(t, q\)"):
        given()
