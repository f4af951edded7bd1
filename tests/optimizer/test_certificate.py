"""The certificate of hand-made splines: correct ones are confirmed, violations never pass."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Certificate, Clearance, Energy, Payload, Pose, Problem, Spline
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.dynamics.losses import breakdown
from tests.by_pinocchio import flange
from tests.optimizer.moves import GOAL, ROBOT, START, problem_with

# relative; values met exactly on the grid, up to double precision through a few thousand operations
ROUNDING = 1e-9
# relative; a peak h/2 from the nearest of the grid's samples is missed by (h/2)² · |x''| / 2|x|:
# for the quintic's acceleration 18 (h / 2T)², 4.5e-6 at 1 ms in 1 s
GRID_MISS = 5e-6
# relative; excess of the certificate's bound between two torque samples over the greatest sample
BETWEEN = 5e-5
# relative; Simpson on 1 ms against Gauss on other panels, both with corners of |x| inside intervals
QUADRATURE = 1e-5

TRAVEL = np.abs(GOAL - START)
PAYLOAD = Payload(
    mass=2.0, com=np.array([0.02, -0.03, 0.1]), inertia=np.diag([0.004, 0.005, 0.003])
)
GRAVITY = np.array([2.0, -4.0, -8.7])


def quintic(start: Array = START, goal: Array = GOAL, duration: float = 1.0) -> Spline:
    """10τ³ - 15τ⁴ + 6τ⁵ as one Bézier segment: three control points at each end."""
    knots = np.concatenate([np.zeros(6), np.full(6, duration)])
    return Spline(5, knots, np.array([start] * 3 + [goal] * 3))


def problem(**given: object) -> Problem:
    return problem_with(
        **{"start": START, "goal": GOAL, "payload": PAYLOAD, "gravity": GRAVITY} | given
    )


def samples(start: Array, goal: Array, t: Array, duration: float) -> tuple[Array, Array, Array]:
    """q, v, a (k, nq) of the quintic, written out."""
    s, change = (t / duration)[:, None], goal - start
    return (
        start + change * (10 * s**3 - 15 * s**4 + 6 * s**5),
        change * 30 * (s - s**2) ** 2 / duration,
        change * 60 * (s - 3 * s**2 + 2 * s**3) / duration**2,
    )


def by_crba(task: Problem, q: Array, v: Array, a: Array) -> Array:
    """Torques (k, nq) = M(q) a + h(q, v): composite rigid bodies and nonlinear effects instead of
    Newton-Euler.
    """
    load = task.arm.payload
    model = task.arm.robot.loaded_model(load.mass, load.com, load.inertia, task.arm.gravity)
    data = model.createData()
    tau = np.empty_like(q)
    for k in range(len(q)):
        upper = np.triu(pin.crba(model, data, q[k], pin.Convention.WORLD))
        M = upper + np.triu(upper, 1).T
        tau[k] = M @ a[k] + pin.nonLinearEffects(model, data, q[k], v[k])
    return tau


def honest(
    task: Problem, start: Array = START, goal: Array = GOAL, duration: float = 1.0
) -> Energy:
    """The quintic's energy by Gauss-Legendre on 400 panels and torques of their own route."""
    x, w = np.polynomial.legendre.leggauss(4)
    panel = duration / 400
    t = (np.arange(400)[:, None] * panel + (x + 1) / 2 * panel).ravel()
    q, v, a = samples(start, goal, t, duration)
    load = task.arm.payload
    model = task.arm.robot.loaded_model(load.mass, load.com, load.inertia, task.arm.gravity)
    data = model.createData()
    change = pin.computePotentialEnergy(model, data, goal) - pin.computePotentialEnergy(
        model, data, start
    )
    tau = by_crba(task, q, v, a)
    weights = np.tile(w / 2 * panel, 400)
    return breakdown(weights, v, a, tau, change, task.arm)


@pytest.fixture(scope="module")
def energy() -> Energy:
    return honest(problem())


def test_confirms_an_honest_answer(energy: Energy) -> None:
    """The quintic's peaks are known: 15/8 Δ/T, 10/√3 Δ/T², 60 Δ/T³."""
    task = problem()
    certificate = certify(task, quintic(), START, GOAL, energy)
    limits, most = ROBOT.limits, TRAVEL.max()
    ratios = certificate.worst_ratio
    assert ratios["velocity"] == pytest.approx(15 / 8 * most / limits.v_max[0], rel=ROUNDING)
    assert ratios["acceleration"] == pytest.approx(
        10 / math.sqrt(3) * most / limits.a_max[0], rel=GRID_MISS
    )
    assert ratios["jerk"] == pytest.approx(60 * most / limits.j_max[0], rel=ROUNDING)
    assert max(certificate.start_error + certificate.goal_error) < ROUNDING
    assert certificate.rest_error < ROUNDING
    assert certificate.energy_error < QUADRATURE
    assert certificate.balance_error < QUADRATURE
    assert certificate.valid


@pytest.mark.parametrize("friction", list(ROBOT.friction_laws))
def test_torques_agree_with_another_route(friction: str) -> None:
    """M a + h with the payload, tilted gravity and rotor inertia, plus friction, over the same
    millisecond grid.

    The motion takes half a second, so the peak occurs at speed, with friction.
    """
    task = problem(friction=friction)
    q, v, a = samples(START, GOAL, np.linspace(0.0, 0.5, 501), 0.5)
    tau = by_crba(task, q, v, a)
    expected = (np.abs(tau + ROBOT.friction_laws[friction].torque(v)) / ROBOT.limits.tau_max).max()
    assert abs(expected - (np.abs(tau) / ROBOT.limits.tau_max).max()) > 0.01
    certificate = certify(task, quintic(duration=0.5), START, GOAL, honest(task, duration=0.5))
    assert certificate.worst_ratio["torque"] == pytest.approx(expected, rel=BETWEEN)
    assert certificate.energy_error < QUADRATURE


@pytest.mark.parametrize(
    ("name", "field", "tolerance"),
    [
        ("velocity", "v_max", ROUNDING),
        ("acceleration", "a_max", GRID_MISS),
        ("jerk", "j_max", ROUNDING),
        ("torque", "tau_max", BETWEEN),
    ],
)
def test_a_broken_limit_shows_its_ratio(
    energy: Energy, name: str, field: str, tolerance: float
) -> None:
    """With the last joint's limit at 1 / 1.25 of its peak, only this limit's ratio reads 1.25."""
    q, v, a = samples(START, GOAL, np.linspace(0.0, 1.0, 1001), 1.0)
    tau_motor = by_crba(problem(), q, v, a) + ROBOT.friction.torque(v)
    peak = {
        "v_max": 15 / 8 * TRAVEL[-1],
        "a_max": 10 / math.sqrt(3) * TRAVEL[-1],
        "j_max": 60 * TRAVEL[-1],
        "tau_max": np.abs(tau_motor[:, -1]).max(),
    }[field]
    tight = getattr(ROBOT.limits, field).copy()
    tight[-1] = peak / 1.25
    certificate = certify(
        problem(limits=replace(ROBOT.limits, **{field: tight})), quintic(), START, GOAL, energy
    )
    assert certificate.worst_ratio[name] == pytest.approx(1.25, rel=tolerance)
    assert all(ratio < 1 for other, ratio in certificate.worst_ratio.items() if other != name)
    assert not certificate.valid


def test_an_end_on_an_uneven_position_limit_reads_one(energy: Energy) -> None:
    limits = ROBOT.limits
    q_min, q_max = limits.q_min.copy(), limits.q_max.copy()
    q_min[0], q_max[0] = START[0], GOAL[0]  # both ends on a limit, neither opposite the other
    task = problem(limits=replace(limits, q_min=q_min, q_max=q_max))
    certificate = certify(task, quintic(), START, GOAL, energy)
    assert certificate.worst_ratio["position"] == pytest.approx(1.0, abs=ROUNDING)
    assert certificate.valid


def test_a_motion_beyond_a_position_limit_is_refused(energy: Energy) -> None:
    """There and back: both ends are inside, the turning point at half time is 0.1 rad outside."""
    limits = ROBOT.limits
    knots = np.concatenate(
        [np.zeros(6), np.full(6, 0.5), np.full(6, 1.0)]
    )  # two quintics, one after the other
    bulge = np.zeros(6)
    bulge[1] = 0.5
    top = START + bulge
    spline = Spline(5, knots, np.array([START] * 3 + [top] * 6 + [START] * 3))
    q_max = limits.q_max.copy()
    q_max[1] = START[1] + 0.4
    task = problem(goal=START, limits=replace(limits, q_max=q_max))
    certificate = certify(task, spline, START, START, energy)
    half = (q_max[1] - limits.q_min[1]) / 2
    assert certificate.worst_ratio["position"] == pytest.approx(1 + 0.1 / half, rel=ROUNDING)
    assert not certificate.valid


def test_a_missed_goal_shows(energy: Energy) -> None:
    """The base joint off by δ: the TCP turns by δ and moves by the chord of its circle about the
    base's axis.
    """
    delta = 1e-3
    spline = quintic(goal=GOAL + np.array([delta, 0, 0, 0, 0, 0]))
    radius = float(np.hypot(*flange(ROBOT, GOAL)[:2, 3]))
    certificate = certify(problem(), spline, START, GOAL, energy)
    assert certificate.goal_error == pytest.approx(
        (2 * radius * math.sin(delta / 2), delta), rel=1e-6
    )  # of 1e-3
    assert max(certificate.start_error) < ROUNDING
    assert not certificate.valid
    backwards = certify(replace(problem(), goal=START, start=GOAL), spline, GOAL, START, energy)
    assert min(*backwards.start_error, *backwards.goal_error) > 0.1


def test_a_full_turn_is_not_the_same_goal(energy: Energy) -> None:
    """Forward kinematics cannot distinguish them, but the user's cables can."""
    turned = GOAL.copy()
    turned[5] += 2 * math.pi
    certificate = certify(problem(), quintic(goal=turned), START, turned, energy)
    assert certificate.goal_error[0] < ROUNDING
    assert certificate.goal_error[1] == pytest.approx(2 * math.pi, rel=ROUNDING)
    assert not certificate.valid


def test_pose_targets_are_of_the_tcp(energy: Energy) -> None:
    """A goal pose moved by 2 mm and turned by 3 mrad about the TCP's own z reads just so, tool
    included.
    """
    tool = pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.2, 1.0), np.array([0.05, 0.0, 0.15]))
    tcp = pin.SE3(flange(ROBOT, GOAL)) * tool
    moved = tcp * pin.SE3(pin.rpy.rpyToMatrix(0, 0, 3e-3), np.array([0.0, 2e-3, 0.0]))
    exact = problem(goal=Pose(tcp.homogeneous), T_flange_tcp=tool.homogeneous)
    certificate = certify(exact, quintic(), START, GOAL, energy)
    assert max(certificate.goal_error) < ROUNDING
    assert certificate.valid
    missed = certify(replace(exact, goal=Pose(moved.homogeneous)), quintic(), START, GOAL, energy)
    assert missed.goal_error == pytest.approx(
        (2e-3, 3e-3), rel=1e-6
    )  # log3 of a small angle loses a few digits
    assert not missed.valid


def test_ends_that_are_not_at_rest_show(energy: Energy) -> None:
    """Two coinciding control points leave an acceleration of 20 Δc / T² at the end, one leaves
    speed as well.
    """
    spline = quintic()
    points = spline.control_points.copy()
    points[3, 0] -= 0.01
    certificate = certify(problem(), replace(spline, control_points=points), START, GOAL, energy)
    assert certificate.rest_error == pytest.approx(20 * 0.01 / ROBOT.limits.a_max[0], rel=1e-6)
    assert not certificate.valid
    points[1] += 0.1
    moving = certify(problem(), replace(spline, control_points=points), START, GOAL, energy)
    assert moving.rest_error > 5 * 0.1 / ROBOT.limits.v_max[0] - ROUNDING


@pytest.mark.parametrize("kind", ["electrical", "mechanical"])
def test_an_energy_misreported_shows(energy: Energy, kind: str) -> None:
    """One hundredth less is reported: the error is relative to the reported energy."""
    part = getattr(energy, kind)
    wrong = replace(energy, **{kind: replace(part, total=part.total / 1.01)})
    certificate = certify(problem(), quintic(), START, GOAL, wrong)
    assert certificate.energy_error == pytest.approx(0.01, abs=QUADRATURE)
    assert not certificate.valid


def test_parts_that_do_not_add_up_show(energy: Energy) -> None:
    electrical = energy.electrical
    wrong = replace(
        energy,
        electrical=replace(electrical, friction=electrical.friction + 0.02 * electrical.total),
    )
    certificate = certify(problem(), quintic(), START, GOAL, wrong)
    assert certificate.balance_error == pytest.approx(0.02, abs=QUADRATURE)
    assert not certificate.valid


def test_short_motions_get_a_fine_grid(energy: Energy) -> None:
    """20 ms: on a millisecond grid the peak of acceleration would be missed by 2e-3, on a hundredth
    part by 3e-5.
    """
    spline = quintic(goal=START + 1e-4, duration=0.02)
    certificate = certify(problem(goal=START + 1e-4), spline, START, START + 1e-4, energy)
    peak = 10 / math.sqrt(3) * 1e-4 / 0.02**2
    assert certificate.worst_ratio["acceleration"] == pytest.approx(
        peak / ROBOT.limits.a_max[0], rel=1e-4
    )


@pytest.mark.parametrize("broken", ["control_points", "knots"])
def test_nothing_undefined_passes(energy: Energy, broken: str) -> None:
    """NaN in a control point, or a spline with a first knot other than zero, compares false with
    every tolerance.
    """
    spline = quintic()
    if broken == "control_points":
        points = spline.control_points.copy()
        points[2, 4] = math.nan
        spline = replace(spline, control_points=points)
    else:
        spline = replace(spline, knots=np.maximum(spline.knots, 0.05))
    assert not certify(problem(), spline, START, GOAL, energy).valid


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "jerk", "torque"])
def test_a_certificate_with_nan_is_not_valid(name: str) -> None:
    ratios = dict.fromkeys(["position", "velocity", "acceleration", "jerk", "torque"], 0.5)
    clearance = Clearance(0.01, 0.01, ("base", "tool"), 0.0)
    good = Certificate(
        ratios, (0.0, 0.0), (0.0, 0.0), 0.0, 0.0, 0.0, 0.0, clearance, close_pass=None
    )
    assert good.valid
    assert not replace(good, worst_ratio=ratios | {name: math.nan}).valid
    assert not replace(good, goal_error=(0.0, math.nan)).valid
    assert not replace(good, energy_error=math.nan).valid
    assert good.clearance is not None
    assert not replace(good, clearance=replace(good.clearance, min_clearance=-1e-9)).valid
    assert not replace(good, clearance=replace(good.clearance, min_clearance=math.nan)).valid
