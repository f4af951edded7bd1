"""Arms from URDF files, and the first certified motion of each arm.

`python -m benchmarks.arms FILES` prints one line per file. The arm is the chain from the root to
the link with a usual name of a tip, such as `tool0`, or else the longest chain of revolute joints.
Missing figures of a file are assumed, because the benchmark tests only the steps from the file to a
certified motion.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from joulepath import Arm, ConeOrientedPose, JoulepathError, Pose, Problem, export, optimize
from joulepath.models.from_figures import robot_of
from joulepath.models.own_arm.description import Description, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.mesh_files import in_folder
from joulepath.models.own_arm.rules import RULES
from joulepath.models.own_arm.urdf_tree import TURNING, UrdfTree, joint_end, parsed_urdf
from joulepath.models.own_arm.xacro_file import SUFFIX, expanded, package_folders
from joulepath.models.robot import Array, Robot
from joulepath.models.uploads.limits import unwatched
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.problem.targets import Target

TIPS = (
    "tool0",
    "flange",
    "ee_link",
    "ee_arm_link",
    "end_effector",
    "tcp",
    "gripper_frame_link",
    "link_eef",
)
FULL_POSE = 6
"""Number of joints from which an arm reaches full poses."""


@dataclass(frozen=True)
class Assumed:
    """Figures in place of missing figures of a file, and settings of the motion."""

    acceleration: float = 5.0
    """Acceleration limit [rad/s²]."""
    payload: float = 0.5
    """Payload [kg]."""
    velocity: float = 2.0
    """Speed limit [rad/s]."""
    torque: float = 1e4
    """Torque limit [N·m] for a file without efforts. It is too large for all but the largest arms,
    so that friction and rotor inertia are estimated from the torques that the arm needs."""
    placeholder: float = 1.0
    """Largest effort of a joint in a file that counts as a placeholder [N·m]."""
    deadline: float = 30.0
    """Deadline of the motion [s]."""
    draws: int = 400
    """Number of random configurations from which start and goal of the motion are chosen."""
    held: float = 0.7
    """Largest holding torque at the start and goal over the torque limit [1]."""


ASSUMED = Assumed()


@dataclass(frozen=True)
class ArmOutcome:
    """The outcome of one file."""

    file: str
    joints: int = 0
    inverse: str = ""
    """Kind of inverse kinematics."""
    status: str = ""
    """Status of the answer; empty without an answer."""
    energy: float = 0.0
    bound: float = 0.0
    wall: float = 0.0
    """Time [s] from the file to the motion."""
    message: str = ""
    """Reason of the refusal of the file, or of the motion."""

    @property
    def is_read(self) -> bool:
        """Whether the file describes a robot."""
        return self.joints > 0

    def __str__(self) -> str:
        if not self.is_read:
            return f"{self.file}: refused: {self.message}"
        head = f"{self.file}: {self.joints} joints, {self.inverse}"
        if not self.status:
            return f"{head}: no motion: {self.message}"
        return (
            f"{head}: {self.status}, {self.energy:.1f} J, bound {self.bound:.1f} J, "
            f"written for ros2, {self.wall:.1f} s"
        )


def first_motion(
    file: Path,
    packages: Sequence[Path],
    arguments: Mapping[str, str],
    seed: int,
) -> ArmOutcome:
    """The outcome of a file, from its text to a motion exported for ROS 2.

    Args:
        file: a URDF, or a file with xacro macros.
        packages: folders with ROS packages.
        arguments: values of the arguments of a file with macros.
        seed: seed of start and goal of the motion.
    """
    began, read = time.perf_counter(), ArmOutcome(file.name)
    try:
        robot = robot_of(file.name.split(".")[0], figures_of(file, packages, arguments))
    except (InvalidArm, ValueError, OSError) as error:
        return replace(read, message=str(error).replace("\n", " "))
    read = replace(read, joints=robot.nq, inverse="no inverse kinematics")
    try:
        is_complete = required_inverse_kinematics(robot, "goal").complete
        kind = "complete" if is_complete else "searched"
        read = replace(read, inverse=f"{kind} inverse kinematics")
        start, goal = _targets(robot, *_ends(robot, seed))
        problem = Problem(arm=Arm(robot=robot), start=start, goal=goal, deadline=ASSUMED.deadline)
        answer = optimize(problem)
        export(answer, "ros2", problem=problem)
    except JoulepathError as error:
        return replace(read, message=f"{error.slug()}: {error}".replace("\n", " "))
    assert answer.certificate.valid
    return replace(
        read,
        status=str(answer.status),
        energy=answer.energy.electrical.total,
        bound=answer.lower_bound,
        wall=time.perf_counter() - began,
    )


def figures_of(
    file: Path,
    packages: Sequence[Path],
    arguments: Mapping[str, str],
) -> dict[str, object]:
    """Figures of the arm in a file. Raises InvalidArm with the remaining problems."""
    folders = [*packages, *package_folders(file)]
    if file.suffix == SUFFIX:
        urdf = expanded(file, arguments, folders)
    else:
        urdf = file.read_text(encoding="utf-8", errors="replace")
    tree = UrdfTree.of(parsed_urdf(urdf, unwatched))
    tip = tip_of(tree)
    chain = _turning(tree, tip)
    limits = [joint.find("limit") for joint in chain]
    effort, speed = (
        all(limit is not None and float(limit.get(part, "0")) > least for limit in limits)
        for part, least in (("effort", ASSUMED.placeholder), ("velocity", 0.0))
    )
    meshes = dict[str, bytes]()
    for folder in (file.parent, *folders):
        meshes = in_folder(folder, urdf) | meshes
    description = Description(
        urdf=urdf,
        base=base_of(tree, tip),
        tip=tip,
        acceleration=ASSUMED.acceleration,
        payload=ASSUMED.payload,
        torque=None if effort else ASSUMED.torque,
        velocity=None if speed else ASSUMED.velocity,
        locked="others",
        mend_inertias=True,
        meshes=meshes,
    )
    try:
        return own_figures(file.stem, description)[0]
    except InvalidArm as error:
        if not any(field in ("urdf", "masses") for field, _ in error.problems):
            raise
        # the file may lack masses
        with suppress(InvalidArm):
            return own_figures(file.stem, replace(description, density=RULES.density))[0]
        raise


def tip_of(tree: UrdfTree) -> str:
    """The link with a usual name of a tip and the most revolute joints below it, or else the link
    at the end of the longest chain. Raises InvalidArm for a file without revolute joints.
    """
    usual = [link for link in tree.links if link.endswith(TIPS) and len(_turning(tree, link)) > 1]
    tip = max(usual or tree.links, key=lambda link: len(_turning(tree, link)))
    chain = _turning(tree, tip)
    if not chain:
        raise InvalidArm("urdf", "No joint of the file turns.")
    # links beyond the last revolute joint, such as fingers, are no tips
    return tip if usual else joint_end(chain[-1], "child")


def base_of(tree: UrdfTree, tip: str) -> str:
    """The link beyond the last sliding joint on the way to the tip, for example of a lifting
    column; the root without such a joint.
    """
    sliding = [j for j in tree.path(tree.root, tip) if j.get("type") not in (*TURNING, "fixed")]
    return joint_end(sliding[-1], "child") if sliding else tree.root


def _turning(tree: UrdfTree, link: str) -> list[Element]:
    """Revolute joints from the base to a link."""
    path = tree.path(base_of(tree, link), link)
    return [joint for joint in path if joint.get("type") in TURNING]


def _targets(robot: Robot, q_start: Array, q_goal: Array) -> tuple[Target, Target]:
    """The poses of two configurations (nq,) [rad]; for an arm with fewer than six joints, the first
    configuration and the position of the second one.
    """
    start, goal = (Pose(tcp_pose(Arm(robot=robot), q)) for q in (q_start, q_goal))
    if robot.nq >= FULL_POSE:
        return start, goal
    return q_start, ConeOrientedPose(goal.T[:3, 3])


def _ends(robot: Robot, seed: int) -> Iterator[Array]:
    """Two random configurations that the arm can hold, free of collisions if possible."""
    limits, rng = robot.limits, np.random.default_rng(seed)
    low, high = np.maximum(limits.q_min, -np.pi), np.minimum(limits.q_max, np.pi)
    q = low + rng.uniform(0.1, 0.9, (ASSUMED.draws, robot.nq)) * (high - low)
    arm = Arm(robot=robot)
    zero = np.zeros_like(q)
    weight = np.abs(Plant(arm).torques(q, zero, zero)) / limits.tau_max
    clear = collision_model(arm).signed_distances(q)[0].min(axis=1, initial=np.inf)
    order = np.lexsort((-clear, weight.max(axis=1) > ASSUMED.held))
    yield from q[order[:2]]
