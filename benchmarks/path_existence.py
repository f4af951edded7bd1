"""Whether there is a path where the project's planner finds none: OMPL's planners as they come are asked.

    python -m benchmarks.path_existence --count 100

The random cells of `benchmarks.scenes` are drawn. Those with a clear start and goal to which the project's planner
finds no path are left out there. What it adds to OMPL could starve a search: boxes of configurations, slices, weighted
joints, reserves and limits of states. Here there is none of it, and time is ample; Coal checks the states. The exit
code is 1 if one of the draws that are left out has a path.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from benchmarks.cells import draws
from benchmarks.command import on_one_core, parser, write_json
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.collision.state_validity import StateValidityChecker
from joulepath.optimizer.problem.arm import Arm

# distance [rad] between checked states of an edge, and farthest [rad] from the start that a joint goes
STEP, FARTHEST = 0.05, 2 * np.pi
# time of each planner [s]
PATIENCE = 40.0
# one grows trees from both ends, the other cells where the known ones are few
PLANNERS = (og.RRTConnect, og.LBKPIECE1)


def path_exists(arm: Arm, q_start: Array, q_goals: Sequence[Array], patience: float, seed: int = 1) -> bool:
    """Whether a planner finds a path from q_start (nq,) to one of q_goals (nq,) [rad] in `patience` [s] each."""
    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(seed)
    limits, checker = arm.active_limits, StateValidityChecker(arm, collision_model(arm))
    space = ob.RealVectorStateSpace(arm.robot.nq)
    bounds = ob.RealVectorBounds(arm.robot.nq)
    for joint, q in enumerate(q_start):
        bounds.setLow(joint, float(max(limits.q_min[joint], q - FARTHEST)))
        bounds.setHigh(joint, float(min(limits.q_max[joint], q + FARTHEST)))
    space.setBounds(bounds)
    information = ob.SpaceInformation(space)
    joints = range(arm.robot.nq)
    information.setStateValidityChecker(lambda state: checker.is_valid(np.array([state[joint] for joint in joints])))
    information.setStateValidityCheckingResolution(STEP / space.getMaximumExtent())
    information.setup()

    def state(q: Array) -> ob.RealVectorStateType:
        made = space.allocState()
        for joint, value in enumerate(q.tolist()):
            made[joint] = value
        return made

    for planner_of in PLANNERS:
        problem = ob.ProblemDefinition(information)
        problem.addStartState(state(q_start))
        goals = ob.GoalStates(information)
        for q_goal in q_goals:
            goals.addState(state(q_goal))
        problem.setGoal(goals)
        planner = planner_of(information)
        planner.setProblemDefinition(problem)
        planner.setup()
        planner.solve(patience)
        if problem.hasExactSolution():
            return True
    return False


def main() -> int:
    """Draws the cells, and asks about those that are left out."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=100, help="tasks (%(default)s)")
    arguments.add_argument("--patience", type=float, default=PATIENCE, help="time of each planner [s] (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    drawn, left_out = 0, list[tuple[str, bool]]()
    for index in range(given.count):
        for each in draws(given.seed, index):
            drawn += 1
            if each.reached() is not None:
                break
            name = f"seed {given.seed} index {index} draw {each.draw} ({each.cell})"
            left_out.append((name, path_exists(each.arm, each.q_start, each.q_goals, given.patience)))
            print(f"{name}: {'a path exists' if left_out[-1][1] else 'no planner finds a path'}", flush=True)
    missed = sum(exists for _, exists in left_out)
    print(f"{drawn} draws with a clear start and goal, {len(left_out)} left out, {missed} of them with a path")
    write_json(given.json, {"seed": given.seed, "drawn": drawn, "left_out": left_out})
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
