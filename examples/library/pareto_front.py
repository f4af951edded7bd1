"""The Pareto front of duration and energy, drawn into a file. Needs matplotlib.

python -m examples.library.pareto_front front.png
"""

from __future__ import annotations

import sys

import numpy as np
from matplotlib.figure import Figure

from joulepath import Arm, Problem, load_robot, pareto

POINTS = 4

start = np.radians([0, -30, 60, -120, -90, 0])
goal = np.radians([40, -100, 60, -50, -90, 0])
# the mechanical energy still falls where the electrical one already rises with the idle power
problem = Problem(
    arm=Arm(robot=load_robot("ur5e")),
    start=start,
    goal=goal,
    objective="mechanical",
    duration_max=2.0,
    deadline=60.0,
)

front = pareto(problem, POINTS)

print(f"{front.status}: {len(front.points)} motions, the fastest in {front.shortest:.2f} s")
for point in front.points:
    print(
        f"{point.duration:.2f} s: {point.energy.mechanical.total:.1f} J, bound "
        f"{point.lower_bound:.1f} J"
    )

path = sys.argv[1] if len(sys.argv) > 1 else "front.png"
figure = Figure(figsize=(6, 4), layout="constrained")
axes = figure.subplots()
durations = [point.duration for point in front.points]
axes.step(
    durations, [point.energy.mechanical.total for point in front.points], where="post", marker="o"
)
axes.set(xlabel="duration [s]", ylabel="mechanical energy [J]")
figure.savefig(path)
print(path)
