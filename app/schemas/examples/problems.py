"""Examples of errors: one example per error type with data of its own."""

from __future__ import annotations

import numpy as np

from joulepath.app.exceptions.access import NotOwner, RoleTooLow
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import StoreUnavailable, TooManyLogs
from joulepath.app.exceptions.transport import HeadTooLarge, RequestTimeout
from joulepath.app.schemas.examples.values import HOME, LABEL, NEAR
from joulepath.optimizer.cycle.errors import CycleTooShort, NoSequence
from joulepath.optimizer.evaluate.errors import NotCertified
from joulepath.optimizer.exceptions import (
    ContradictoryOrder,
    DeadlineExceeded,
    DeclaredError,
    InvalidTable,
    NoConfigurationFound,
    NoTrajectory,
    OutsideLimits,
    SingularPose,
    UnknownRobot,
    UnknownTool,
    UnreachablePose,
    UnreachableTargets,
)
from joulepath.optimizer.excitation.errors import ExcitationInfeasible
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.identify.errors import (
    EffortNotUsable,
    LogTooLarge,
    MethodNotApplicable,
    NotExcited,
    NothingHeldOut,
    PayloadUnknown,
)
from joulepath.optimizer.joint_limits.errors import NoJointLimits
from joulepath.optimizer.kinematics.errors import OrientationNotHeld
from joulepath.optimizer.placement.errors import NoPlacement, ReasonCounts
from joulepath.optimizer.result.candidates import (
    CandidateReport,
    CandidateStatus,
    UnreachableTarget,
)
from joulepath.optimizer.search.errors import (
    CollidingBranch,
    DurationTooShort,
    GoalInCollision,
    NoCollisionFreeTrajectory,
    PathAttempt,
    PathInfeasible,
    StartInCollision,
    StopInCollision,
    TorqueInfeasible,
)

_OUT_OF_REACH = (
    "The goal pose is 0.12 m out of reach in this orientation: move the position closer to the "
    "robot's workspace, or change the orientation."
)
_COLLIDES = "it collides: table and forearm miss 0.031 m of clearance"
_CANDIDATE = CandidateReport(
    start=LABEL,
    start_target=0,
    goal=LABEL,
    goal_target=0,
    q_start=np.array(HOME),
    q_goal=np.array(NEAR),
    status=CandidateStatus.FAILED,
    reason=_COLLIDES,
    lower_bound=171.0,
)
_COLLIDING = CollidingBranch(
    label=LABEL, target=0, q=np.array(HOME), pair=("table", "forearm"), depth=0.031
)
_ATTEMPT = PathAttempt(label=LABEL, followed=0.62, reason="outside_limits")

_EXAMPLES: dict[type[DeclaredError], DeclaredError] = {
    type(error): error
    for error in (
        InvalidRequest([{"loc": ["body", "start", "q"], "msg": "Give at least 1 items, not 0"}]),
        ContradictoryOrder(
            "before asks for 'pick' before 'place', but together lists 'place' first: leave out "
            "one of them.",
            ["pick", "place"],
        ),
        InvalidTable("q3 in line 17 is not a finite number: correct or delete it.", 17, "q3"),
        OutsideLimits("start", "elbow_joint", 3.5, -3.1416, 3.1416),
        UnknownRobot("r2d2", ["ur10e", "ur3e", "ur5e"]),
        UnknownTool(["franka_hand", "onrobot_rg2", "robotiq_2f_85"]),
        UnreachablePose("goal", 0.12, _OUT_OF_REACH),
        NoConfigurationFound("goal", within_limits=False),
        OrientationNotHeld("goal", within_limits=False, joints=5),
        SingularPose("goal", 1e-9),
        UnreachableTargets("goal", [UnreachableTarget("goal", 0, _OUT_OF_REACH)]),
        NoTrajectory([_CANDIDATE]),
        DeadlineExceeded([_CANDIDATE]),
        StartInCollision("start", [_COLLIDING]),
        GoalInCollision("goal", [_COLLIDING]),
        StopInCollision("stops/pick", [_COLLIDING]),
        PathInfeasible(0.08, [_ATTEMPT], "stops/pick/approach", is_line=True),
        DurationTooShort(bound=0.8298, shortest=0.83, proven=True),
        TorqueInfeasible("shoulder_lift_joint", 171.0, 150.0),
        NoCollisionFreeTrajectory(
            [_CANDIDATE], pair=("table", "forearm"), depth=0.031, time=0.62, start=LABEL, goal=LABEL
        ),
        NoSequence("stops/place", [LABEL], [LABEL]),
        CycleTooShort(5.55, 0.9),
        NoPlacement(
            ReasonCounts(reach=61, collision=39, torque=0, time=0, motion=0),
            f"The stops/pick pose{_OUT_OF_REACH.removeprefix('The goal pose')}",
        ),
        NotCertified(0, "its velocity is at 1.31 of the limit", {"velocity": 1.31}),
        NoJointLimits("shoulder_lift_joint", 758.0, 692.9),
        FormatUnsuitable("urscript", "This robot has 7 joints: use ros2."),
        LogTooLarge(1_000_000, "rows"),
        EffortNotUsable(
            "The efforts are without gravity: log motor currents.",
            "external",
            {"shoulder_lift_joint": 0.02, "elbow_joint": 0.03},
        ),
        NotExcited(["coulomb", "viscous"], {"robot": "ur5e", "parameters": ["rotor", "friction"]}),
        NothingHeldOut(1),
        MethodNotApplicable("periodic", "Log at least two periods of the motion."),
        PayloadUnknown([0, 5]),
        ExcitationInfeasible("clearance"),
        StoreUnavailable("full"),
        TooManyLogs(1_073_741_824),
        RoleTooLow("read", "compute"),
        NotOwner("press_shop"),
        HeadTooLarge(32_768),
        RequestTimeout(10.0),
    )
}


def example_of(kind: type[DeclaredError]) -> DeclaredError:
    """An error of this type."""
    return _EXAMPLES[kind] if kind in _EXAMPLES else kind()
