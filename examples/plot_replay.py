"""Draws planned and simulated motor torques of a motion, for the planned arm and with more
friction.

    .venv/bin/python -m examples.plot_replay docs/images/replay_torques.png

The motion is the motion of `examples/replay/lift_with_payload.json`; MuJoCo simulates it. The
command needs matplotlib and MuJoCo.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.replay.controller import command, gains
from joulepath.optimizer.replay.play import play
from joulepath.optimizer.replay.reference import course_of, reference
from joulepath.optimizer.replay.simulated_arm import SimulatedArm, with_changes

# The palette of Okabe and Ito can be distinguished by colour-blind readers.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"]
LOW = np.array([0.5, -2.57, 2.57, -1.07, -1.07, 0.5])
HOME = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
STEP = 2.5e-4
"""Step of the simulation [s]."""
FRICTION = 1.3
"""Friction of the second arm over the planned friction [1]."""
MARKS = 120
"""Number of simulated steps between two marks."""


def main() -> None:
    """Optimises the motion, simulates it twice, and draws both simulations."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path, help="file for the picture")
    file = parser.parse_args().file
    arm = Arm(robot=load_robot("ur5e"), payload=Payload(mass=2.0, com=np.array([0.0, 0.0, 0.06])))
    found = optimize(Problem(arm=arm, start=LOW, goal=HOME))
    motion, plant = reference(course_of(found.trajectory.spline), found.duration, STEP), Plant(arm)
    asked = command(plant, motion, "feed_forward", gains(plant, motion.q[0], motion.step))
    planned = plant.torques(motion.q, motion.v, motion.a) + arm.friction_law.torque(motion.v)
    simulated, t = SimulatedArm(arm), np.arange(len(motion.q)) * motion.step
    figure = Figure(figsize=(9, 7), layout="constrained")
    rows = figure.subplots(2, 1, sharex=True)
    titles = (
        "The arm as planned",
        f"{FRICTION:g} times the friction, unknown to the controller",
    )
    for axes, title, factor in zip(rows, titles, (1.0, FRICTION), strict=True):
        simulated.use_figures(with_changes(arm, friction=factor))
        played = play(simulated, motion, asked)
        for joint, colour in enumerate(COLOURS):
            axes.plot(t, planned[:, joint], color=colour, linewidth=1.2)
            axes.plot(
                t[::MARKS],
                played.tau_motor[::MARKS, joint],
                "o",
                color=colour,
                markersize=4,
                label=f"J{joint + 1}",
            )
        off = float(np.abs(played.q - motion.q).max())
        axes.set(
            title=f"{title}: joints within {1e3 * off:.2g} mrad of the motion",
            ylabel="motor torque [N·m]",
        )
        axes.grid(alpha=0.3)
    rows[1].set_xlabel("time [s]")
    rows[0].legend(ncols=6, fontsize="small", title="lines: planned, dots: simulated")
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    main()
