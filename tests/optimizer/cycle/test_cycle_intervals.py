"""How well the energy of a cycle, and its savings, are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Cycle, CycleMove, Payload, Robot, Stop, plan_cycle
from joulepath.models.uncertainty.spread import spread_of
from joulepath.optimizer.dynamics.dwell import dwell_energy, holding_power
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.dynamics.plant import REPORT
from joulepath.optimizer.motion.spline import fine_samples
from tests.optimizer.dynamics.test_interval import nominal, with_values
from tests.optimizer.moves import AMPLE, GOAL, PAYLOAD, ROBOT, START, fixed, problem, torques

# of the half-width: the energy is not quite linear in the figures, and both sides are drawn
ENDS = 0.25
SAMPLES = 300


class Replayed:
    """Energies [J] of a move and its rest with other figures, by the report's formulas and
    Pinocchio's torques.
    """

    def __init__(self, asked: Cycle, move: CycleMove) -> None:
        self.asked, self.planned, self.length = asked, move.planned, move.planned.dwell + move.wait
        spline, still = move.solution.trajectory.spline, np.zeros((1, 6))
        self.weights, q, self.v, self.a = fine_samples(spline, REPORT.nodes_per_panel)
        before, after = (
            problem(payload=arm.payload) for arm in (move.planned.arm, move.planned.arm_after)
        )
        self.tau = torques(before, q, self.v, self.a)
        self.held = torques(after, spline.control_points[-1:], still, still)[0]

    def __call__(self, robot: Robot) -> float:
        moving, resting = (
            replace(arm, robot=robot) for arm in (self.planned.arm, self.planned.arm_after)
        )
        tau = self.tau + (robot.drives.rotor_inertia - ROBOT.drives.rotor_inertia) * self.a
        energy = breakdown(self.weights, self.v, self.a, tau, 0.0, moving).electrical.total
        if self.length == 0:
            return energy
        hold = float(holding_power(resting, self.held))
        return energy + dwell_energy(self.asked.dwell_of(self.length), resting, hold, 0.0)


@pytest.mark.long
def test_a_cycle_and_its_savings() -> None:
    """The interval of a cycle's energy and savings matches a new evaluation with drawn figures.

    The cycle has moves with and without payload, dwells and a wait.
    """
    stops = [
        Stop(name="pick", target=GOAL, dwell=0.4, payload=PAYLOAD),
        Stop(name="place", target=START + 0.3, dwell=0.2, payload=Payload()),
    ]
    asked = Cycle(
        arm=Arm(robot=ROBOT, collisions=False),
        stops=stops,
        start=START,
        **fixed(6.0),
        deadline=AMPLE,
    )
    found = plan_cycle(asked)
    interval = found.energy.electrical.interval
    assert interval is not None and sum(interval.shares.values()) == pytest.approx(1.0)
    law, spread = ROBOT.friction, spread_of(ROBOT, ROBOT.friction.name)
    chosen = np.random.default_rng(5).choice(len(spread.draws), SAMPLES, replace=False)
    robots = [
        with_values(ROBOT, law, nominal(problem()) + spread.mean + spread.draws[k]) for k in chosen
    ]
    replayed = [Replayed(asked, move) for move in found.moves]
    assert sum(each(ROBOT) for each in replayed) == pytest.approx(
        found.energy.electrical.total, rel=1e-4
    )
    again = np.array([sum(each(robot) for each in replayed) for robot in robots])
    half = (interval.p95 - interval.p5) / 2
    low, high = np.quantile(again, [0.05, 0.95])
    assert abs(interval.p5 - low) < ENDS * half and abs(interval.p95 - high) < ENDS * half
    assert interval.sd == pytest.approx(again.std(), rel=ENDS)
    assert {"same_factor", "fastest_then_wait"} <= {each.name for each in found.baselines}
    for each in found.baselines:
        if each.name == "move_by_move":
            continue
        known = each.saving_interval
        assert known.p5 < known.p95 and known.sd < interval.sd / found.energy.electrical.total
        assert known.p5 - 3 * known.sd < each.saving < known.p95 + 3 * known.sd
