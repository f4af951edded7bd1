"""Power and energy at rest in the configurations of a stop, on motors or brakes."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.dynamics.dwell import (
    brake_power,
    dwell_energy,
    holding_power,
    holding_times,
)
from joulepath.optimizer.dynamics.interval import arm_spread
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.dynamics.sensitivity import waiting_sensitivity
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.energy import Sensitivity


def holding_powers(move: PlannedMove, goal: Layer) -> Array:
    """Power (n,) [W] of holding the arm on its motors after a move, for every configuration of its
    goal.
    """
    q = np.array([end.q for end in goal.ends])
    return np.asarray(Plant(move.arm_after).holding_power(q)[goal.end])


def long_wait_powers(cycle: Cycle, move: PlannedMove, goal: Layer) -> Array:
    """Power (n,) [W] of a further second of a long wait after a move, for every configuration of
    its goal.
    """
    if cycle.hold == "motors":
        return holding_powers(move, goal)
    return np.full(len(goal.q), brake_power(cycle.dwell_of(1.0), move.arm_after))


def least_holding_power(move: PlannedMove) -> float:
    """Least power [W] of holding the arm on its motors after a move in any configuration: without
    torque.
    """
    arm = move.arm_after
    return float(holding_power(arm, np.zeros(arm.robot.nq)))


def rest_energy(cycle: Cycle, move: PlannedMove, length: float, hold: float) -> float:
    """Energy of a rest after a move [J].

    Args:
        cycle: the cycle.
        move: the move before the rest.
        length: duration of the rest [s].
        hold: power of holding the arm on its motors [W].
    """
    return dwell_energy(cycle.dwell_of(length), move.arm_after, hold, 0.0) if length > 0 else 0.0


def rest_sensitivity(cycle: Cycle, move: PlannedMove, length: float, q: Array) -> Sensitivity:
    """Sensitivity of `rest_energy` at q (nq,) [rad] to the arm's figures."""
    arm = move.arm_after
    spread = arm_spread(arm)
    if length <= 0:
        return Sensitivity(np.zeros_like(spread.mean), 0.0)
    dwell = cycle.dwell_of(length)
    held = Plant(arm).holding_torques(q[None])[0]
    return waiting_sensitivity(arm, q, held, *holding_times(dwell, 0.0), dwell, spread)


def least_dwell_cost(cycle: Cycle, move: PlannedMove) -> float:
    """Lower bound [J] of the objective of the dwell after a move, in any configuration."""
    if cycle.objective == "mechanical":
        return 0.0
    return rest_energy(cycle, move, move.dwell, least_holding_power(move))


def dwell_energies(cycle: Cycle, move: PlannedMove, goal: Layer) -> Array:
    """Energy (n,) [J] of the dwell after a move, for every configuration of its goal."""
    first = np.unique(goal.end, return_index=True)[1]
    powers = holding_powers(move, goal)
    # full turns do not change the power
    energies = np.zeros(len(goal.ends))
    energies[goal.end[first]] = [
        rest_energy(cycle, move, move.dwell, hold) for hold in powers[first].tolist()
    ]
    return energies[goal.end]


def dwell_costs(cycle: Cycle, move: PlannedMove, goal: Layer) -> Array:
    """Objective (n,) [J] of the dwell after a move, for every configuration of its goal.

    Rests need no mechanical work.
    """
    return (
        dwell_energies(cycle, move, goal)
        if cycle.objective == "electrical"
        else np.zeros(len(goal.q))
    )
