"""Whether there is a collision-free path at all: OMPL's planners as they come, apart from the project's own planner.

What `optimizer.collision.path_planner` adds to OMPL could starve a search: boxes of configurations, slices, weighted
joints, reserves and limits of states. Here there is none of it. Coal checks the states.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from models.robot import Array
from optimizer.collision.model import collision_model
from optimizer.collision.state_validity import StateValidityChecker
from optimizer.problem.arm import Arm

# distance [rad] between checked states of an edge, and farthest [rad] from the start that a joint goes
STEP, FARTHEST = 0.05, 2 * np.pi
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
