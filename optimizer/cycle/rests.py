"""What the arm draws at rest in the configurations of a stop, on its motors or on its brakes."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.dynamics.dwell import brake_power, dwell_energy, holding_power, waits
from joulepath.optimizer.dynamics.interval import arm_spread
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.dynamics.sensitivity import waiting_sensitivity
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.energy import Sensitivity


def holding_powers(move: PlannedMove, goal: Layer) -> Array:
    """Power (n,) [W] that holding the arm on its motors draws after a move, in each configuration
    of its goal.
    """
    arm = move.arm_after
    still = np.zeros((len(goal.ends), arm.robot.nq))
    tau = Plant(arm).torques(np.array([end.q for end in goal.ends]), still, still)
    return np.asarray(holding_power(arm, tau)[goal.end])


def long_wait_powers(asked: Cycle, move: PlannedMove, goal: Layer) -> Array:
    """Power (n,) [W] of every further second of a long wait after a move, in each configuration of
    its goal.
    """
    if asked.hold == "motors":
        return holding_powers(move, goal)
    return np.full(len(goal.q), brake_power(asked.waiting(1.0), move.arm_after))


def least_holding_power(move: PlannedMove) -> float:
    """Least power [W] that holding the arm draws after a move in any configuration: with no torque
    to hold.
    """
    arm = move.arm_after
    return float(holding_power(arm, np.zeros(arm.robot.nq)))


def rest_energy(asked: Cycle, move: PlannedMove, length: float, hold: float) -> float:
    """Energy [J] of a rest of `length` [s] after a move, where holding the arm on its motors draws
    `hold` [W].
    """
    return dwell_energy(asked.waiting(length), move.arm_after, hold, 0.0) if length > 0 else 0.0


def rest_sensitivity(asked: Cycle, move: PlannedMove, length: float, q: Array) -> Sensitivity:
    """How `rest_energy` at q (nq,) [rad] hangs on the arm's figures."""
    arm = move.arm_after
    spread = arm_spread(arm)
    if length <= 0:
        return Sensitivity(np.zeros_like(spread.mean), 0.0)
    dwell = asked.waiting(length)
    still = np.zeros((1, len(q)))
    held = Plant(arm).torques(q[None], still, still)[0]
    return waiting_sensitivity(arm, q, held, *waits(dwell, 0.0), dwell, spread)


def dwell_energies(asked: Cycle, move: PlannedMove, goal: Layer) -> Array:
    """Energy (n,) [J] of the dwell after a move, in each configuration of its goal."""
    first = np.unique(goal.end, return_index=True)[1]
    powers = holding_powers(move, goal)
    # full turns change nothing
    energies = np.zeros(len(goal.ends))
    energies[goal.end[first]] = [
        rest_energy(asked, move, move.dwell, hold) for hold in powers[first].tolist()
    ]
    return energies[goal.end]


def dwell_costs(asked: Cycle, move: PlannedMove, goal: Layer) -> Array:
    """What the dwell after a move adds to the objective (n,) [J], in each configuration of its
    goal: standing still needs no work."""
    return (
        dwell_energies(asked, move, goal)
        if asked.objective == "electrical"
        else np.zeros(len(goal.q))
    )
