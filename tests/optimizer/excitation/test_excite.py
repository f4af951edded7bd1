"""Excitations separate parameters, rest at their ends and keep their limits; gradients and
deviations are right.
"""

from __future__ import annotations

import re

import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    Arm,
    DeadlineExceeded,
    ExcitationInfeasible,
    InvalidProblem,
    Obstacle,
    OutsideLimits,
    Payload,
    Scene,
    Sphere,
    ToolCone,
    load_robot,
)
from joulepath.models.robot import Array
from joulepath.optimizer.excitation import excite as module
from joulepath.optimizer.excitation.excitation_problem import Criterion, ExcitationProblem
from joulepath.optimizer.excitation.excitation_result import Excitation
from joulepath.optimizer.excitation.excite import MOUNTING_PLANE, excite
from joulepath.optimizer.excitation.fourier import FourierBasis
from joulepath.optimizer.excitation.information import Information
from joulepath.optimizer.excitation.torque_columns import TorqueColumns
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from tests.by_pinocchio import torques_of
from tests.refusals import refusal_of

ARM = Arm(robot=load_robot("ur5e"))
# of finite differences over 2e-6 of a cost with corners in its second derivative
GRADIENT = 1e-3
FRICTION = ("coulomb", "viscous", "offset", "load")


@pytest.fixture(scope="module")
def found() -> Excitation:
    """A short search from one start."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "EXCITATION", module.ExcitationSettings(max_evaluations=80))
        return excite(ExcitationProblem(arm=ARM, starts=1, deadline=np.inf))


def test_the_least_sample_period_that_a_refusal_names_is_accepted() -> None:
    with pytest.raises(InvalidProblem) as refusal:
        ExcitationProblem(arm=ARM, period=50.1, sample_period=1e-4)
    named = float(re.findall(r"[0-9.]+(?= s )", str(refusal.value))[-1])
    ExcitationProblem(arm=ARM, period=50.1, sample_period=named)


def test_the_series_is_at_rest_at_its_ends_and_the_spline_is_the_series(found: Excitation) -> None:
    series = found.coefficients
    k = np.arange(1, series.a.shape[1] + 1)
    w = 2 * np.pi / series.period * k
    assert (
        np.abs(series.a.sum(axis=1)).max() < 1e-12
        and np.abs((series.b * k).sum(axis=1)).max() < 1e-12
    )
    t = np.linspace(0, series.period, 301)
    q = (
        series.centre
        + np.sin(np.outer(t, w)) @ (series.a / w).T
        - np.cos(np.outer(t, w)) @ (series.b / w).T
    )
    # the spline has 24 spans for every harmonic
    assert np.abs(found.trajectory.spline.curve(t) - q).max() < 1e-6
    v, a = (np.asarray(found.trajectory.spline.curve(t[[0, -1]], order)) for order in (1, 2))
    assert np.abs(v).max() < 1e-9 and np.abs(a).max() < 1e-7


def test_limits_clearance_and_condition(found: Excitation) -> None:
    certificate = found.certificate
    assert certificate.valid
    assert certificate.worst_ratio["velocity"] <= 0.6 * (1 + 1e-6)
    assert certificate.clearance is not None and certificate.clearance.min_clearance >= 0.02
    assert found.scaled_condition <= 60 < found.condition
    assert (found.starts, found.feasible) == (1, 1)
    # the load of shoulder and elbow varies enough to determine its friction
    assert [each.parameter for each in found.predicted_sd[40 + 18 :]] == ["load2", "load3"]


def test_the_plane_that_the_arm_stands_on_is_kept(found: Excitation) -> None:
    model = ARM.robot.model
    data, flange = model.createData(), model.getFrameId("flange")
    for t in np.linspace(0, found.coefficients.period, 200):
        pin.framesForwardKinematics(model, data, found.trajectory.spline.curve(t))
        assert data.oMf[flange].translation[2] > 0


def test_a_log_of_it_gives_the_predicted_deviations() -> None:
    """Least squares on noisy torques scatter as predicted."""
    random = np.random.default_rng(5)
    columns = random.normal(size=(300, 4)) @ random.normal(size=(4, 4))
    truth = np.array([1.0, -2.0, 0.5, 3.0])
    predicted = Information(columns).deviations(len(columns))
    fits = [
        np.linalg.lstsq(columns, columns @ truth + random.normal(size=len(columns)), rcond=None)[0]
        for _ in range(2000)
    ]
    # of a standard deviation from 2000 draws: 1.6 %
    assert np.std(fits, axis=0) == pytest.approx(predicted, rel=0.06)


@pytest.mark.parametrize("kind", ["d", "condition"])
def test_gradient_of_the_cost(kind: Criterion) -> None:
    design = module._Design(ExcitationProblem(arm=ARM, period=4.0, harmonics=3, criterion=kind))
    random = np.random.default_rng(2)
    start = design.start(0)
    assert start is not None
    # far enough for limits and clearances to matter
    x = start + np.vstack([np.zeros(6), random.normal(size=start[1:].shape)])
    _, gradient = design.cost(x)
    for _ in range(4):
        step = 1e-6 * random.normal(size=x.shape)
        difference = (design.cost(x + step)[0] - design.cost(x - step)[0]) / 2
        assert difference == pytest.approx(float((gradient * step).sum()), rel=GRADIENT, abs=1e-9)


def test_the_columns_give_pinocchios_torques() -> None:
    columns = TorqueColumns(ARM, ("inertials", "rotor"), 7)
    random = np.random.default_rng(3)
    q, v, a = random.uniform(-2, 2, (3, 7, 6))
    expected = torques_of(ARM.robot.model, q, v, a)
    # independent columns are found to 1e-8
    assert np.abs(columns.values(q, v, a) @ columns.dynamics - expected).max() < 1e-6
    assert len(columns.wanted) == 40


def test_load_friction_is_a_column() -> None:
    """The column of the rigid torque, including the payload; none for joints with little load."""
    loaded = Arm(robot=ARM.robot, payload=Payload(4.0, np.array([0.0, 0.0, 0.1])))
    columns = TorqueColumns(loaded, ("friction",), 7)
    random = np.random.default_rng(3)
    q, v, a = random.uniform(-2, 2, (3, 7, 6))
    v += np.sign(v)  # where the sign of the speed is one
    model = rigid_body_model(loaded)
    model.armature = np.zeros(6)
    tau = torques_of(model, q, v, a)
    values = columns.values(q, v, a)
    for name in ("load2", "load3"):
        joint, column = int(name[-1]) - 1, values[:, :, columns.names.index(name)]
        assert column[:, joint] == pytest.approx(
            np.abs(tau[:, joint]) * np.sign(v[:, joint]), rel=0.02, abs=1.6
        )
        assert not np.delete(column, joint, axis=1).any()
    assert {"load1", "load6"}.isdisjoint(columns.names)
    assert len(columns.wanted) == len([each for each in columns.names if each[:-1] in FRICTION])


def test_series_at_rest_have_two_directions_fewer() -> None:
    basis = FourierBasis(3.0, 4)
    assert basis.resting.shape == (8, basis.free) == (8, 6)
    ends = np.array([0.0, 3.0])
    assert (
        np.abs(basis.matrix(ends, 1)).max() < 1e-12 and np.abs(basis.matrix(ends, 2)).max() < 1e-11
    )


def test_no_room_is_said() -> None:
    """A centre inside an obstacle leaves no motion."""
    ball = Obstacle("ball", Sphere(0.5), np.eye(4))
    arm = Arm(robot=ARM.robot, scene=Scene([ball]))
    with pytest.raises(ExcitationInfeasible, match="clearance") as caught:
        excite(ExcitationProblem(arm=arm, starts=2, deadline=np.inf))
    assert caught.value.limit == "clearance"


def test_a_joint_that_is_nearly_locked_stays_within_its_range() -> None:
    """The predicted deviations show that its figures are almost undetermined."""
    robot = load_robot("ur5e")
    locked = robot.limits.tightened(
        q_min=np.r_[-5e-4, robot.limits.q_min[1:]], q_max=np.r_[5e-4, robot.limits.q_max[1:]]
    )
    found = excite(
        ExcitationProblem(
            arm=Arm(robot=robot, limits=locked), harmonics=2, parts=("rotor", "friction"), starts=1
        )
    )
    assert found.certificate.valid and np.abs(found.trajectory.q[:, 0]).max() <= 5e-4
    of_joint, others = (
        [each.sd for each in found.predicted_sd if ("1" in each.parameter) == first]
        for first in (True, False)
    )
    assert np.isfinite(of_joint).all() and max(of_joint) > 1e6 * max(others)


def test_a_motion_beyond_a_range_is_no_refusal_of_a_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """An excitation has no start: the search falls back to a smaller motion."""

    def far(self: object, coordinates: Array, deadline: object) -> Array:
        return np.vstack([coordinates[:1], 50.0 * coordinates[1:]])

    monkeypatch.setattr(module._Design, "improved", far)
    found = excite(ExcitationProblem(arm=Arm(robot=load_robot("ur5e"), collisions=False), starts=1))
    assert found.certificate.valid


def test_the_deviations_of_columns_that_are_nearly_dependent() -> None:
    """The inverse of [[1, 1], [0, e]] is [[1, -1/e], [0, 1/e]]."""
    e = 1e-9
    deviations = Information(np.array([[1.0, 1.0], [0.0, e]])).deviations(2.0)
    assert deviations == pytest.approx([np.hypot(1, 1 / e), 1 / e], rel=1e-6)


def test_no_time_is_said() -> None:
    with pytest.raises(DeadlineExceeded):
        excite(ExcitationProblem(arm=ARM, deadline=1e-3))


def test_an_obstacle_of_the_planes_name_stands_for_it() -> None:
    own = Scene([Obstacle(MOUNTING_PLANE, Sphere(0.05), np.diag([1.0, 1, 1, 1]))])
    arm = module._with_mounting_plane(ExcitationProblem(arm=Arm(robot=ARM.robot, scene=own)))
    assert len(arm.scene.obstacles) == 1
    assert len(module._with_mounting_plane(ExcitationProblem(arm=ARM)).scene.obstacles) == 1
    assert not module._with_mounting_plane(
        ExcitationProblem(arm=ARM, mounting_plane=False)
    ).scene.obstacles


@pytest.mark.parametrize(
    ("field", "given"),
    [
        ("period", {"period": 0.0}),
        ("period", {"period": float("nan")}),
        ("harmonics", {"harmonics": 1}),
        ("speed_fraction", {"speed_fraction": 2.0}),
        ("parameters", {"parts": ()}),
        ("parameters", {"parts": ("power",)}),
        ("criterion", {"criterion": "e"}),
        ("centre", {"centre": np.zeros(5)}),
        ("noise", {"noise": -1.0}),
        (
            "tool_cone",
            {"arm": Arm(robot=ARM.robot, tool_cone=ToolCone(np.eye(3)[2], -np.eye(3)[2], 0.2))},
        ),
    ],
)
def test_wrong_problems(field: str, given: dict[str, object]) -> None:
    with refusal_of(field):
        ExcitationProblem(**{"arm": ARM, **given})  # type: ignore[arg-type]


def test_a_centre_out_of_range_is_refused() -> None:
    with pytest.raises(OutsideLimits) as caught:
        ExcitationProblem(arm=ARM, centre=np.full(6, 10.0))
    assert caught.value.target == "centre"


@pytest.mark.parametrize("other", [0.0, 1.0], ids=["without effect", "as another one"])
def test_a_parameter_that_the_motion_does_not_determine_is_predicted_as_unknown(
    other: float,
) -> None:
    columns = np.random.default_rng(0).normal(size=(50, 3))
    columns[:, 1] = other * columns[:, 0]
    deviations = Information(columns).deviations(50)
    assert np.isfinite(deviations).all()
    assert deviations[1] > 1e12 and deviations[2] < 1.0
