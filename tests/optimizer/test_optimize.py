"""The one door: whatever comes out of it is certified, true to its own figures, and no worse than what others do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import cycle, product
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import BSpline

from models.robot import Array
from optimizer.certificate import certify
from optimizer.energy.kernel_cache import compile_kernel
from optimizer.exceptions import (
    DeadlineExceeded,
    DurationTooShort,
    InvalidProblem,
    JoulepathError,
    NoTrajectory,
    TorqueInfeasible,
    UnreachablePose,
)
from optimizer.optimize import optimize
from optimizer.problem.arm import Payload
from optimizer.problem.branches import BranchFilter
from optimizer.problem.pose import Pose
from optimizer.problem.problem import Problem
from optimizer.search.baselines import saving
from optimizer.search.reserve import RESERVE
from optimizer.solution import Certificate, Solution
from optimizer.trajectories.seven_segment import shortest_duration
from tests.optimizer.clocks import LAST_READINGS, CountingClock
from tests.optimizer.moves import (
    CEILING,
    GOAL,
    HOME,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    fixed,
    limits,
    paper_poses,
    potential,
    problem,
    random_moves,
    tcp_pose,
    torques,
)
from tests.selection import long_but

ROUNDING = 1e-9
# relative; what a solver that stops where a step promises 5e-5 of the cost may leave behind, twice
CONVERGED = 1e-3
BALANCE = 1e-3  # of the total: the identity of energy that is promised
# relative; the two energies are sums over panels of their own, with corners of |x| inside (see QUADRATURE in
# test_baselines); a motion that is its own baseline differs by 1e-5 from itself
NOT_BEATEN = 5e-5
ONE_PERCENT = 0.01  # by which a B-spline may exceed the time-scaled motion in the same duration
SYMMETRY = 2e-3  # relative; two runs whose optima are mirror images, reached along ways that are not
# the paper's home in Universal Robots' convention [deg] (see tests/reference/README.md)


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    compile_kernel(ROBOT)


def total(solution: Solution, task: Problem) -> float:
    """The energy that was minimised [J]."""
    return solution.energy.of(task.objective)


def shortest(start: Array = START, goal: Array = GOAL, **given: Any) -> float:
    return float(shortest_duration(goal - start, problem(start, goal, **given).arm.active_limits))


def assert_true(solution: Solution, task: Problem) -> None:
    """All that every answer promises, recomputed where that is not the certificate's own work."""
    assert solution.certificate.valid
    electrical, own = solution.energy.electrical, total(solution, task)
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=BALANCE)
    assert solution.lower_bound <= own
    assert solution.lower_bound == min(each.lower_bound for each in solution.candidates)
    assert min(each.energy for each in solution.candidates if each.energy is not None) == pytest.approx(own)
    least, most = task.duration_min or 0.0, task.duration_max or math.inf
    assert least <= solution.duration <= most
    for each in solution.baselines:
        theirs = getattr(each, task.objective)
        assert each.saving == pytest.approx(saving(own, theirs), abs=ROUNDING)
        allowed = least * (1 - ROUNDING) <= each.duration <= most * (1 + ROUNDING)
        if each.within_limits and allowed and each.duration > 0 and task.method == "bspline":
            assert own <= theirs * (1 + NOT_BEATEN), each
    trajectory = solution.trajectory
    assert trajectory.t[-1] == pytest.approx(solution.duration, abs=ROUNDING)
    assert trajectory.q[0] == pytest.approx(solution.start.q, abs=1e-7)
    assert trajectory.q[-1] == pytest.approx(solution.goal.q, abs=1e-7)


def solved(task: Problem) -> Solution:
    solution = optimize(task)
    assert_true(solution, task)
    return solution


CONDITIONS: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "loaded": {"payload": PAYLOAD},
    "loaded to the rating": {"payload": Payload(mass=5.0, com=np.array([0.0, 0.03, 0.08]))},
    "wall": {"gravity": [0, 9.81, 0], "payload": PAYLOAD},
    "ceiling": {"gravity": CEILING, "payload": PAYLOAD},
    "weightless": {"gravity": [0, 0, 0]},
    "plain friction": {"friction": "coulomb_viscous"},
    "slow": {"limits": limits(v_max=0.6, a_max=2.0, j_max=10.0)},
    "smooth": {"limits": limits(j_max=15.0)},
    "weak": {"limits": limits(tau_max=[60, 100, 60, 14, 14, 14]), "payload": Payload(mass=1.0)},
    "half recovered": {"robot": replace(ROBOT, electronics=replace(ROBOT.electronics, regeneration=0.5))},
    "idles cheaply": {"robot": replace(ROBOT, electronics=replace(ROBOT.electronics, idle_power=4.0))},
}


@pytest.mark.parametrize(
    ("name", "method"),
    long_but(
        list(zip(CONDITIONS, cycle(("bspline", "time_scaling")), strict=False)),
        product(CONDITIONS, ("bspline", "time_scaling")),
    ),
)
def test_answers_are_true(name: str, method: str) -> None:
    """Electrical energy with free duration, over conditions, of three moves of which one is short."""
    for k, (start, goal) in enumerate(random_moves(41, 4)):
        if method == "bspline" or k != 1:
            task = problem(start, goal, method=method, **CONDITIONS[name])
            try:
                assert solved(task).status == "optimal"
            except TorqueInfeasible:
                assert name in ("weak", "loaded to the rating")  # an end that cannot be held


@pytest.mark.parametrize(
    ("name", "method"),
    long_but(
        [("as it comes", "bspline"), *((name, "time_scaling") for name in ("weak", "ceiling", "half recovered"))],
        product(CONDITIONS, ("bspline", "time_scaling")),
    ),
)
def test_mechanical_answers_are_true(name: str, method: str) -> None:
    """In 1.5 times the shortest duration, and in up to 1.2 times."""
    given = CONDITIONS[name]
    least = shortest(**given)
    for durations in (fixed(1.5 * least), {"duration_max": 1.2 * least}):
        task = problem(method=method, objective="mechanical", **durations, **given)
        solved(task)


SHORT: dict[str, dict[str, Any]] = {
    "electrical": {},
    "at least 1.4 s": {"duration_min": 1.4},
    "mechanical": {"objective": "mechanical", "duration_max": 0.5},
    "mechanical, loaded": {"objective": "mechanical", "duration_max": 3.0, "payload": PAYLOAD},
}


@pytest.mark.parametrize("name", long_but(("electrical",), SHORT))
def test_short_moves_are_not_beaten(name: str) -> None:
    """Of a milliradian to some hundredths: so slow that friction's reversal, which is smoothed, is all of the way."""
    rng = np.random.default_rng(44)
    for size in (1e-3, 3e-3, 1e-2, 3e-2):
        start = rng.uniform(-np.pi, np.pi, 6)
        solved(problem(start, np.clip(start + size * rng.normal(size=6), -np.pi, np.pi), **SHORT[name]))


def pairs(objective: str) -> Iterator[tuple[Problem, Problem]]:
    """Problems that differ in the method only, the second in the first's duration and between the same joints."""
    for k, (start, goal) in enumerate(random_moves(42, 6)):
        given = list(CONDITIONS.values())[k]
        longest = None if objective == "electrical" else 1.6 * shortest(start, goal, **given)
        free = problem(start, goal, objective=objective, duration_max=longest, **given)
        yield free, replace(free, method="time_scaling")


@pytest.mark.parametrize("objective", long_but(["electrical"], ["electrical", "mechanical"]))
def test_a_bspline_spends_no_more_than_a_time_scaled_motion(objective: str) -> None:
    """In the same duration: the straight line is one of its choices."""
    compared = 0
    for free, line in pairs(objective):
        ours = solved(free)
        try:
            theirs = solved(replace(line, **fixed(ours.duration)))
        except DurationTooShort:
            continue  # along the line there may be no motion as fast
        assert total(ours, free) <= total(theirs, line) * (1 + ONE_PERCENT)
        compared += 1
    assert compared >= 4


def test_the_trajectory_is_that_of_the_spline() -> None:
    """Samples from SciPy's spline, torques from Pinocchio, power from the definition; Σ P Δt is the energy."""
    task = problem(payload=PAYLOAD, gravity=TILTED, sample_period=0.004)
    solution = solved(task)
    path, spline = solution.trajectory, solution.trajectory.spline
    curve = BSpline(spline.knots, spline.control_points, spline.degree)
    assert np.diff(path.t)[:-1] == pytest.approx(0.004) and 0 < path.t[-1] - path.t[-2] <= 0.004 + ROUNDING
    for d, samples in enumerate((path.q, path.v, path.a)):
        assert samples == pytest.approx(curve(path.t, d), abs=1e-7)
    tau = torques(task, path.q, path.v, path.a)
    assert path.tau == pytest.approx(tau, abs=1e-7)
    tau_motor = tau + task.arm.friction_law.torque(path.v)
    assert path.tau_motor == pytest.approx(tau_motor, abs=1e-7)
    drives = ROBOT.drives
    joints = tau_motor * path.v + drives.copper * (tau_motor / drives.torque_constant) ** 2
    assert path.power == pytest.approx(np.maximum(36.7 + joints.sum(axis=1), 0.0), abs=1e-6)
    electrical = solution.energy.electrical
    assert np.trapezoid(path.power, path.t) == pytest.approx(electrical.total, rel=5e-3)  # samples 4 ms apart
    assert electrical.idle == pytest.approx(36.7 * solution.duration, rel=ROUNDING)
    assert electrical.potential == pytest.approx(potential(task, GOAL) - potential(task, START), abs=1e-8)
    assert electrical.recovered == 0
    assert solution.energy.peak_power >= path.power.max() * (1 - 1e-3)
    assert solution.energy.mean_power == pytest.approx(electrical.total / solution.duration, rel=ROUNDING)


def test_regeneration_gives_energy_back() -> None:
    """A load let down by a metre: what is recovered is negative and lowers the total; more of it lowers it more."""
    high, low = np.array([0.0, -1.9, 0.9, -1.0, -1.57, 0.0]), np.array([0.0, -0.6, 0.9, -1.0, -1.57, 0.0])
    totals = []
    for regeneration in (0.0, 0.4, 1.0):
        robot = replace(ROBOT, electronics=replace(ROBOT.electronics, idle_power=4.0, regeneration=regeneration))
        electrical = solved(problem(high, low, robot=robot, payload=Payload(mass=5.0))).energy.electrical
        assert electrical.recovered == pytest.approx(-regeneration * electrical.braking, rel=ROUNDING, abs=0)
        totals.append(electrical.total)
    assert totals[0] > totals[1] > totals[2]


# --- duration ---


@pytest.mark.parametrize("method", ["bspline", "time_scaling"])
@pytest.mark.parametrize(
    ("objective", "duration"),
    long_but(
        [("mechanical", 2.345), *(("electrical", duration) for duration in (0.74, 2.345, 7.0))],
        product(("electrical", "mechanical"), (0.74, 1.1, 2.345, 7.0)),
    ),
)
def test_fixed_durations_are_kept_exactly(objective: str, duration: float, method: str) -> None:
    assert solved(problem(objective=objective, method=method, **fixed(duration))).duration == duration


@pytest.mark.parametrize("method", ["bspline", "time_scaling"])
def test_duration_bounds_are_kept(method: str) -> None:
    """To the last digit, where the best duration lies outside them; inside, they change nothing."""
    best = solved(problem(method=method)).duration
    slow = solved(problem(method=method, duration_min=1.3 * best)).duration
    assert 1.3 * best <= slow < 1.3 * best * (1 + CONVERGED)
    wide = solved(problem(method=method, duration_min=0.5 * best, duration_max=2 * best)).duration
    assert wide == pytest.approx(best, rel=0.01)  # the energy is flat in the duration
    cheap = CONDITIONS["idles cheaply"]
    leisurely = solved(problem(method=method, **cheap)).duration
    capped = solved(problem(method=method, duration_max=0.8 * leisurely, **cheap)).duration
    assert 0.8 * leisurely * (1 - 0.02) < capped <= 0.8 * leisurely


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"method": "time_scaling"},
        {"limits": limits(v_max=0.8)},
        {"payload": PAYLOAD, "limits": limits(tau_max=[60, 100, 60, 14, 14, 14])},
        pytest.param({"objective": "mechanical"}, marks=pytest.mark.long),
        {"goal": tcp_pose(GOAL)},
        pytest.param({"start": tcp_pose(START), "goal": tcp_pose(GOAL), "windings": False}, marks=pytest.mark.long),
    ],
    ids=lambda given: ", ".join(given) or "as it comes",
)
def test_the_shortest_duration_that_is_told_holds(given: dict[str, Any]) -> None:
    """Asked for exactly that, or a little more, there is a motion; asked for less, there is none, told alike."""
    with pytest.raises(DurationTooShort) as refusal:
        optimize(problem(**given, **fixed(0.1)))
    told = refusal.value.shortest
    assert f"{told:.4f}" in str(refusal.value)
    for share in (1.0, 1.01):
        for durations in (fixed(told * share), {"duration_max": told * share}):
            assert solved(problem(**given, **durations)).duration <= told * share
    with pytest.raises(DurationTooShort) as again:
        optimize(problem(**given, **fixed(0.98 * told)))
    assert again.value.shortest == pytest.approx(told, rel=1e-3)


def test_the_shortest_duration_is_nearly_the_seven_segments() -> None:
    """Where torque is ample, the arm can be told to be as fast as its slowest joint, or hardly slower."""
    for start, goal in random_moves(43, 4):
        least = shortest(start, goal)
        with pytest.raises(DurationTooShort) as refusal:
            optimize(problem(start, goal, **fixed(0.5 * least)))
        assert least * (1 - ROUNDING) <= refusal.value.shortest < 1.02 * least


@pytest.mark.parametrize(("less", "more"), long_but([(0.8, 2.0)], [(0.8, 2.0), (0.8, 1.2), (1.2, 2.0)]))
def test_more_time_is_never_dearer_without_a_price_of_time(less: float, more: float) -> None:
    """The mechanical objective, which a longer duration can only help: up to 2 s is no worse than up to 1 s."""
    fast, slow = (solved(problem(objective="mechanical", duration_max=T)).energy.mechanical.total for T in (less, more))
    assert slow <= fast * (1 + CONVERGED)


# --- deadline ---


def test_no_time_at_all_is_a_deadline_exceeded() -> None:
    clock = CountingClock()
    with pytest.raises(DeadlineExceeded) as refusal:
        optimize(problem(goal=tcp_pose(GOAL), deadline=1e-6), clock)
    assert clock.now < LAST_READINGS
    assert {each.status for each in refusal.value.candidates} <= {"unvisited", "infeasible"}


def test_little_time_gives_the_best_found_so_far() -> None:
    """A search that would take many seconds, cut off: certified, feasible, told which candidates it did not reach."""
    task = problem(start=tcp_pose(START), goal=tcp_pose(GOAL), objective="mechanical", duration_max=2.5)
    readings = 300
    solution = optimize(replace(task, deadline=float(readings)), CountingClock())
    assert_true(solution, task)
    assert readings - RESERVE < solution.solver.wall_time < readings + LAST_READINGS
    assert solution.status == "feasible"
    assert any(each.status == "unvisited" and "deadline" in each.reason for each in solution.candidates)


# --- what cannot be done ---


def test_a_load_that_cannot_be_held_is_told() -> None:
    """The shoulder, what it needs to hold the arm stretched out, and what it has."""
    stretched = np.array([0.0, 0.0, 0.0, 0.0, -1.57, 0.0])
    needed = np.abs(torques(problem(payload=Payload(5.0)), stretched[None], np.zeros((1, 6)), np.zeros((1, 6))))[0, 1]
    own = limits(tau_max=[150, 0.9 * needed, 150, 28, 28, 28])
    with pytest.raises(TorqueInfeasible) as refusal:
        optimize(problem(START, stretched, payload=Payload(5.0), limits=own))
    error = refusal.value
    assert (error.joint, error.needed, error.available) == pytest.approx((ROBOT.joint_names[1], needed, 0.9 * needed))


def test_a_payload_beyond_the_rating_is_refused() -> None:
    solved(problem(payload=Payload(5.0)))
    with pytest.raises(InvalidProblem) as refusal:
        optimize(problem(payload=Payload(5.01)))
    assert refusal.value.field == "payload.mass" and "5 kg" in str(refusal.value)


def test_poses_out_of_reach_are_refused() -> None:
    away = tcp_pose(GOAL).T.copy()
    away[0, 3] += 2.0
    with pytest.raises(UnreachablePose) as far:
        optimize(problem(goal=Pose(away)))
    assert far.value.target == "goal" and far.value.distance is not None and 0.5 < far.value.distance < 2.5


@pytest.mark.parametrize("refused", ["all", "the first"])
def test_nothing_uncertified_is_returned(monkeypatch: pytest.MonkeyPatch, refused: str) -> None:
    """A motion that its certificate does not confirm is not the answer; what it had ruled out may be."""
    judged = []

    def judge(*given: Any) -> Certificate:
        judged.append(given)
        honest = certify(*given)
        if refused == "all" or len(judged) == 1:
            return replace(honest, worst_ratio=honest.worst_ratio | {"torque": 1.01})
        return honest

    monkeypatch.setattr("optimizer.search.incumbent.certify", judge)
    task = problem(goal=tcp_pose(GOAL), windings=False)
    if refused == "the first":
        assert optimize(task).certificate.valid and len(judged) > 1
        return
    with pytest.raises(NoTrajectory) as refusal:
        optimize(task)
    assert any("certificate" in each.reason for each in refusal.value.candidates)
    assert all(each.energy is None for each in refusal.value.candidates)


# --- special motions ---


@pytest.mark.parametrize("given", [{}, fixed(2.0), {"method": "time_scaling"}, {"goal": tcp_pose(START)}], ids=str)
def test_going_nowhere(given: dict[str, Any]) -> None:
    """Start and goal are the same: a motion that idles, holds itself up, and costs no more than staying put does."""
    task = problem(**{"goal": START} | given)
    solution = solved(task)
    tau = torques(task, START[None], np.zeros((1, 6)), np.zeros((1, 6)))[0]
    standing = 36.7 + ROBOT.drives.copper @ (tau / ROBOT.drives.torque_constant) ** 2
    cost = solution.energy.electrical.total
    assert cost <= standing * solution.duration * (1 + CONVERGED)
    if given == fixed(2.0):
        assert cost > 36.7 * 2.0


def test_full_turns_are_made_where_only_they_lead_there() -> None:
    """A goal a full turn of the last joint away is not where the arm already is."""
    solution = solved(problem(goal=START - 2 * math.pi * np.eye(6)[5]))
    assert np.abs(solution.trajectory.q[:, 5] - START[5]).max() == pytest.approx(2 * math.pi, rel=1e-6)
    assert solution.energy.electrical.total > 36.7 * 2.0  # two seconds at 3.14 rad/s


def test_windings_can_be_left_out() -> None:
    """Eight branches instead of all their turns; the best of them is no better than with all."""
    all_of_them = solved(problem(goal=tcp_pose(GOAL)))
    few = solved(problem(goal=tcp_pose(GOAL), windings=False))
    assert len(few.candidates) == 8 < len(all_of_them.candidates)
    assert all_of_them.energy.electrical.total <= few.energy.electrical.total * (1 + CONVERGED)


def test_the_branch_asked_for_is_taken() -> None:
    """At both ends, at the price of a worse motion."""
    best = solved(problem(start=tcp_pose(START), goal=tcp_pose(GOAL)))
    for wanted in (
        BranchFilter("left", "up", "no_flip"),
        BranchFilter("right", "down", "flip"),
        BranchFilter(elbow="down"),
    ):
        solution = solved(problem(start=tcp_pose(START), goal=tcp_pose(GOAL), branch=wanted))
        for label in (solution.start.label, solution.goal.label):
            parts = zip(label.split("/"), (wanted.shoulder, wanted.elbow, wanted.wrist), strict=True)
            assert all(asked in (None, part) for part, asked in parts)
        assert solution.energy.electrical.total >= best.energy.electrical.total * (1 - CONVERGED)


def test_pose_and_joints_agree() -> None:
    """A pose's answer is that of the joints it chose; joints that were given are never beaten by fewer choices."""
    by_pose = solved(problem(goal=tcp_pose(GOAL), payload=PAYLOAD))
    by_joints = solved(problem(goal=by_pose.goal.q, payload=PAYLOAD))
    assert by_pose.energy.electrical.total == pytest.approx(by_joints.energy.electrical.total, rel=CONVERGED)
    direct = solved(problem(payload=PAYLOAD))
    assert by_pose.energy.electrical.total <= direct.energy.electrical.total * (1 + CONVERGED)


def test_a_tool_moves_the_goal_but_not_the_motion() -> None:
    """A pose of the tool's tip, tool told, is the same request as the flange's pose without a tool."""
    tool = pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.2, 1.0), np.array([0.05, 0.0, 0.15])).homogeneous
    bare = solved(problem(goal=tcp_pose(GOAL)))
    tipped = solved(problem(goal=tcp_pose(GOAL, tool), T_flange_tcp=tool))
    assert tipped.goal.q == pytest.approx(bare.goal.q, abs=1e-7) and tipped.goal.label == bare.goal.label
    assert tipped.energy.electrical.total == pytest.approx(bare.energy.electrical.total, rel=1e-6)
    turned = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), np.zeros(3)).homogeneous
    elsewhere = solved(problem(goal=tcp_pose(GOAL), T_flange_tcp=turned))
    assert np.abs(elsewhere.goal.q - bare.goal.q).max() > 0.05


# --- physics ---


@pytest.mark.parametrize(
    "given",
    [{}, pytest.param({"payload": PAYLOAD, "friction": "coulomb_viscous"}, marks=pytest.mark.long)],
    ids=["alone", "loaded"],
)
def test_without_gravity_the_way_back_costs_the_same(given: dict[str, Any]) -> None:
    """Run backwards, speeds change sign, torques too as friction is odd: but braking and driving change places.

    So electrical energies differ, though losses at equal speeds do not; mechanical ones, with |power|, are the same.
    """
    least = shortest()
    there = solved(problem(gravity=[0, 0, 0], objective="mechanical", **fixed(1.4 * least), **given))
    back = solved(problem(GOAL, START, gravity=[0, 0, 0], objective="mechanical", **fixed(1.4 * least), **given))
    assert back.energy.mechanical.total == pytest.approx(there.energy.mechanical.total, rel=0.02)  # local optima


def test_turning_the_base_changes_nothing() -> None:
    """Gravity is along its axis: start and goal turned by the same angle are the same task."""
    turn = np.array([1.1, 0, 0, 0, 0, 0])
    here, there = solved(problem(payload=PAYLOAD)), solved(problem(START + turn, GOAL + turn, payload=PAYLOAD))
    assert there.energy.electrical.total == pytest.approx(here.energy.electrical.total, rel=SYMMETRY)
    assert there.duration == pytest.approx(here.duration, rel=0.02)
    tilted, tilted_there = (
        solved(problem(a, b, payload=PAYLOAD, gravity=TILTED)) for a, b in ((START, GOAL), (START + turn, GOAL + turn))
    )
    assert abs(tilted_there.energy.electrical.total / tilted.energy.electrical.total - 1) > 10 * SYMMETRY


def test_turning_gravity_and_base_together_changes_nothing() -> None:
    """A wall mount turned about the base's axis, and the base joint turned after it."""
    angle = 0.7
    gravity = np.array([9.81, 0, 0])
    turned = (
        np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]) @ gravity
    )
    turn = angle * np.eye(6)[0]
    here = solved(problem(gravity=gravity))
    there = solved(problem(START + turn, GOAL + turn, gravity=turned))
    assert there.energy.electrical.total == pytest.approx(here.energy.electrical.total, rel=SYMMETRY)


def test_a_point_on_the_last_axis_does_not_feel_the_last_joint() -> None:
    """Payloads symmetric about the flange's axis: turning the last joint at both ends changes nothing."""
    disc = Payload(mass=2.0, com=np.array([0, 0, 0.1]), inertia=np.diag([0.004, 0.004, 0.006]))
    # the last link's own mass lies on its axis but for 2.6 cm² of asymmetry, which is nothing to the arm
    turn = 2.0 * np.eye(6)[5]
    here, there = solved(problem(payload=disc)), solved(problem(START + turn, GOAL + turn, payload=disc))
    assert there.energy.electrical.total == pytest.approx(here.energy.electrical.total, rel=SYMMETRY)
    lump = replace(disc, mass=5.0, com=np.array([0.2, 0, 0.1]))
    here, there = solved(problem(payload=lump)), solved(problem(START + turn, GOAL + turn, payload=lump))
    assert abs(there.energy.electrical.total / here.energy.electrical.total - 1) > 2 * SYMMETRY


def test_lifting_costs_more_than_lowering() -> None:
    """By a good part of twice the change of potential energy, which is lent on the way up and mostly burnt down."""
    high, low = np.array([0.0, -1.6, 0.9, -1.0, -1.57, 0.0]), np.array([0.0, -0.7, 0.9, -1.0, -1.57, 0.0])
    up, down = (solved(problem(a, b, payload=Payload(4.0))) for a, b in ((low, high), (high, low)))
    potential_gain = up.energy.electrical.potential
    assert potential_gain > 20 and down.energy.electrical.potential == pytest.approx(-potential_gain, rel=ROUNDING)
    assert up.energy.electrical.total > down.energy.electrical.total + potential_gain


@pytest.mark.parametrize("duration", [None, 1.6])
def test_relaxing_limits_never_costs_energy(duration: float | None) -> None:
    """Tighter by a quarter at a time, of each kind: the energy does not fall, and the bound holds at every step."""
    durations = fixed(duration) if duration else {}
    own = ROBOT.limits
    for name in ("v_max", "a_max", "j_max"):
        totals = []
        for share in (1.0, 0.75, 0.5):
            tight = replace(own, **{name: getattr(own, name) * share})
            totals.append(solved(problem(limits=tight, **durations)).energy.electrical.total)
        assert totals[0] <= totals[1] * (1 + CONVERGED) and totals[1] <= totals[2] * (1 + CONVERGED), name


def test_heavier_loads_cost_more() -> None:
    totals = [
        solved(problem(payload=Payload(mass, np.array([0, 0, 0.1])))).energy.electrical.total
        for mass in (0.0, 2.0, 5.0)
    ]
    assert totals[0] < totals[1] < totals[2]


def test_friction_laws_are_told_apart() -> None:
    """Plain and curved friction have different coefficients; the answer is of the law that was asked for."""
    assert next(iter(ROBOT.friction_laws)) == "curved"
    for law in ROBOT.friction_laws:
        solution = solved(problem(friction=law))
        path = solution.trajectory
        friction = path.tau_motor - path.tau
        assert friction == pytest.approx(ROBOT.friction_laws[law].torque(path.v), abs=1e-7)


def test_waiting_is_dear_where_idling_is() -> None:
    """The more the arm draws at rest, the shorter the best motion."""
    times = []
    for idle in (2.0, 10.0, 36.7):
        robot = replace(ROBOT, electronics=replace(ROBOT.electronics, idle_power=idle))
        times.append(solved(problem(robot=robot)).duration)
    assert times[0] > times[1] > times[2] * (1 - CONVERGED)


def test_the_optimum_is_an_optimum_of_the_duration() -> None:
    """Half a per cent, two per cent, a tenth longer or shorter is no cheaper."""
    best = solved(problem(**CONDITIONS["idles cheaply"]))
    for share in (0.9, 0.98, 0.995, 1.005, 1.02, 1.1):
        other = solved(problem(**CONDITIONS["idles cheaply"], **fixed(share * best.duration)))
        assert other.energy.electrical.total >= best.energy.electrical.total * (1 - CONVERGED)


# --- the founding paper ---


@pytest.mark.parametrize("number", range(1, 16))
def test_the_papers_poses_are_answered(number: int) -> None:
    """From its home to each pose of its Table 1: all are within reach, and each answer reaches the pose."""
    task = problem(HOME, paper_poses()[number - 1])
    try:
        solution = solved(task)
    except JoulepathError as error:
        pytest.fail(f"within the arm's reach, yet refused: {error!r}")
    assert solution.status == "optimal"
    assert np.abs(tcp_pose(solution.goal.q).T - paper_poses()[number - 1].T).max() < 1e-6
    assert 1 - solution.lower_bound / solution.energy.electrical.total < 0.3
