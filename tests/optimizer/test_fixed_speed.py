"""A fixed speed of the TCP on its path: held between the ramps, never exceeded on them, and
certified.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import NoTrajectory, Problem, Solution, ToolPath, optimize
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.problem.tool_path import TOOL_PATH
from tests.optimizer.test_tool_path import ARM, poses_of
from tests.optimizer.tool_paths import along, moved
from tests.refusals import refusal_of
from tests.selection import long_but

# relative: speeds by differences of positions 1/4000 of the motion apart
DIFFERENCE = 1e-4
RAMP = 0.03
LINE = along(moved([0.0, 0.3, 0.0]), path=ToolPath(fixed_speed=0.1, ramp=RAMP))
CORNER = along(
    moved([0.0, 0.2, -0.15]),
    path=ToolPath(via=[moved([0.0, 0.2, 0.0])], blend=0.04, fixed_speed=0.2, ramp=RAMP),
)
CURVE = along(
    moved([0.1, 0.3, 0.0]),
    path=ToolPath(
        shape="curve",
        via=[moved([0.05, 0.1, 0.03]), moved([0.0, 0.2, -0.03])],
        fixed_speed=0.15,
        ramp=RAMP,
    ),
)
ARC = along(
    moved([0.2, 0.2, 0.0]),
    path=ToolPath(shape="arc", via=[moved([0.03, 0.12, 0.0])], fixed_speed=0.1),
)
TASKS = {"line": LINE, "corner": CORNER, "curve": CURVE, "arc": ARC}


def path_of(task: Problem) -> ToolPath:
    assert task.tool_path is not None
    return task.tool_path


def speed_of(task: Problem) -> float:
    speed = path_of(task).fixed_speed
    assert speed is not None
    return speed


def deviations(task: Problem, found: Solution, count: int = 4000) -> tuple[float, float]:
    """Largest deviation from the speed between the ramps, and above it on them, as shares of it; by
    the positions.
    """
    steps = np.linalg.norm(np.diff(poses_of(found, count)[:, :3, 3], axis=0), axis=1)
    off = steps * (count - 1) / found.trajectory.spline.duration / speed_of(task) - 1
    gone = np.cumsum(steps)
    between = (gone > path_of(task).ramp) & (gone < gone[-1] - path_of(task).ramp)
    return float(np.abs(off[between]).max()), float(off.max())


@pytest.mark.parametrize("name", long_but(["curve"], TASKS))
def test_the_speed_is_held(name: str) -> None:
    task = TASKS[name]
    found = optimize(task)
    between, above = deviations(task, found)
    assert (
        found.certificate.valid
        and between < TOOL_PATH.speed_tolerance + DIFFERENCE
        and above < TOOL_PATH.speed_tolerance + DIFFERENCE
    )
    told = found.certificate.worst_ratio["path_speed"] * TOOL_PATH.speed_tolerance
    assert between - DIFFERENCE <= told <= TOOL_PATH.speed_tolerance


def test_the_certificate_finds_a_speed_that_is_not_held() -> None:
    """Too slow, too fast, and one that is right on average."""
    found = optimize(LINE)
    spline, ends = found.trajectory.spline, (found.start.q, found.goal.q)
    for factor, valid in (
        (1.0, True),
        (1 + 2 * TOOL_PATH.speed_tolerance, False),
        (1 - 2 * TOOL_PATH.speed_tolerance, False),
    ):
        other = replace(LINE, tool_path=replace(path_of(LINE), fixed_speed=0.1 * factor))
        assert certify(other, spline, *ends, found.energy).valid == valid
    uneven = optimize(
        replace(LINE, tool_path=replace(path_of(LINE), fixed_speed=None, least_speed=0.095))
    )
    assert uneven.certificate.valid
    assert not certify(LINE, uneven.trajectory.spline, *ends, uneven.energy).valid


def test_its_duration_is_free_by_the_ramps_alone() -> None:
    own = optimize(LINE).trajectory.spline.duration
    longer = own + 0.05
    fixed = optimize(replace(LINE, duration_min=longer, duration_max=longer))
    assert fixed.certificate.valid and fixed.trajectory.spline.duration == pytest.approx(longer)
    with pytest.raises(NoTrajectory) as refusal:
        optimize(replace(LINE, duration_min=2 * own))
    assert "fixed path.speed" in refusal.value.candidates[0].reason


def test_a_speed_beyond_the_joints_says_what_to_do() -> None:
    with pytest.raises(NoTrajectory) as refusal:
        optimize(replace(CORNER, tool_path=replace(path_of(CORNER), fixed_speed=0.6)))
    assert "lower speed" in refusal.value.candidates[0].reason


@pytest.mark.parametrize(
    ("path", "arm"),
    [
        ({"fixed_speed": 0.0}, ARM),
        ({"fixed_speed": np.nan}, ARM),
        ({"fixed_speed": 0.1}, ARM.no_faster_than(0.1)),
    ],
    ids=str,
)
def test_a_wrong_speed_names_its_field(path: dict[str, float], arm: object) -> None:
    with refusal_of("path.speed"):
        along(moved([0.0, 0.3, 0.0]), path=ToolPath(**path), arm=arm)  # type: ignore[arg-type]
