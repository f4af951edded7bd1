import numpy as np
import pytest

from benchmarks.cells import CELLS, cell_task
from benchmarks.scenes import KINDS, failed_requirements, run, summary
from joulepath.optimizer.collision.model import CollisionModel


@pytest.mark.parametrize("index", range(len(CELLS)))
def test_tasks_repeat_and_both_ends_are_clear(index: int) -> None:
    task, again = cell_task(5, index), cell_task(5, index)
    assert task.cell == CELLS[index]
    np.testing.assert_array_equal(task.q_goal, again.q_goal)
    np.testing.assert_array_equal(task.T_goal, again.T_goal)
    assert task.draws == again.draws
    assert CollisionModel(task.arm).least_distance(np.stack([task.q_start, task.q_goal]), 0.0) > 0


@pytest.mark.long
def test_an_answer_in_collision_fails_a_requirement() -> None:
    outcomes = [run(cell_task(5, 0), kind) for kind in KINDS]
    assert [outcome.collisions for outcome in outcomes] == [0, 0]
    assert failed_requirements(summary(outcomes)) == []
    outcomes[0].collisions = 1
    assert len(failed_requirements(summary(outcomes))) == 1
    outcomes[1].error = "NoTrajectory"
    assert len(failed_requirements(summary(outcomes))) == 2
