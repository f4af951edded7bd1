import numpy as np
import pytest

from benchmarks.cells import CELLS, cell_task
from benchmarks.scenes import KINDS, misses, run, summary
from optimizer.collision.model import CollisionModel


@pytest.mark.parametrize("index", range(len(CELLS)))
def test_tasks_repeat_and_both_ends_are_clear(index: int) -> None:
    task, again = cell_task(5, index), cell_task(5, index)
    assert task.cell == CELLS[index]
    np.testing.assert_array_equal(task.q_goal, again.q_goal)
    np.testing.assert_array_equal(task.T_goal, again.T_goal)
    assert task.draws == again.draws
    assert CollisionModel(task.arm).least_distance(np.stack([task.q_start, task.q_goal]), 0.0) > 0


def test_an_answer_that_hits_something_is_a_miss() -> None:
    outcomes = [run(cell_task(5, 0), kind) for kind in KINDS]
    assert [outcome.hits for outcome in outcomes] == [0, 0]
    assert misses(summary(outcomes)) == []
    outcomes[0].hits = 1
    assert len(misses(summary(outcomes))) == 1
    outcomes[1].refusal = "NoTrajectory"
    assert len(misses(summary(outcomes))) == 2
