"""The energy of a recorded motion, and the saving by lighter links: for the same motion, and
re-optimised.

python -m examples.library.recording_and_lighter_links
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath import Arm, Problem, Recording, evaluate, load_robot, optimize, what_if

arm = Arm(robot=load_robot("ur5e"))
lighter = replace(arm, link_mass_scale=np.full(arm.robot.nq, 0.7))

# the recording of a lift of 2 s at 125 Hz, as a controller logs it
t = np.linspace(0.0, 2.0, 251)
low, high = np.radians([60, -30, 70, -120, -75, 30]), np.radians([0, -90, 40, -90, -90, 0])
q = low + np.outer((1 - np.cos(np.pi * t / t[-1])) / 2, high - low)

recorded = evaluate(arm, Recording.of(t, q))
violated = [report.limit for report in recorded.limits if not report.held]
print(
    f"recorded: {recorded.total.energy.electrical.total:.1f} J in {recorded.total.duration:.2f} s"
)
print(f"limits that it violates: {', '.join(violated) or 'none'}")

problem = Problem(arm=arm, start=low, goal=high)
best = optimize(problem)
changed = what_if(best, replace(problem, arm=lighter))
print(f"optimised: {best.energy.electrical.total:.1f} J in {best.duration:.2f} s")
print(
    f"the same motion with links of 70 % of their mass: {changed.same_motion.electrical.total:.1f} "
    "J"
)
if changed.reoptimised is not None:
    print(f"re-optimised for these links: {changed.reoptimised.energy.electrical.total:.1f} J")
