"""The motion of least energy between two joint configurations, and how much it saves.

python -m examples.library.joints_to_joints
"""

from __future__ import annotations

import numpy as np

from joulepath import Arm, Problem, load_robot, optimize

home = np.radians([0, -90, 90, -90, -90, 0])
shelf = np.radians([60, -70, 100, -115, -75, 30])

solution = optimize(Problem(arm=Arm(robot=load_robot("ur5e")), start=home, goal=shelf))

energy = solution.energy.electrical
print(f"{solution.status}: {energy.total:.1f} J in {solution.duration:.2f} s")
print(
    f"of this {energy.idle:.1f} J idle, {energy.friction:.1f} J friction, {energy.copper:.1f} J "
    "copper"
)
print(f"no motion needs less than {solution.lower_bound:.1f} J")
print(
    f"highest ratio of a value to its limit: {max(solution.certificate.worst_ratio.values()):.4f}"
)
for baseline in solution.baselines:
    limits = "within all limits" if baseline.within_limits else "beyond a limit"
    print(f"{baseline.name}: {baseline.electrical:.1f} J in {baseline.duration:.2f} s, {limits}")
