"""Many problems on all cores: from one place to each of a grid, solved as they come, the dearest
and the cheapest told.

python -m examples.library.many_moves
"""

from __future__ import annotations

import numpy as np

from joulepath import Arm, Pose, Problem, load_robot, optimize_many

START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])


def main() -> None:
    """Solves the moves in processes of their own."""
    arm = Arm(robot=load_robot("ur5e"), collisions=False)
    places = [(x, y) for x in (0.35, 0.45, 0.55) for y in (-0.2, 0.2)]
    goals = [Pose.from_rotvec([x, y, 0.2], [np.pi, 0.0, 0.0]) for x, y in places]
    problems = [
        Problem(arm=arm, start=START, goal=goal, windings=False, deadline=300.0) for goal in goals
    ]
    energies = {}
    for found in optimize_many(problems):
        energies[places[found.index]] = found.result().energy.electrical.total
        print(f"{len(energies)} of {len(places)}: {energies[places[found.index]]:.1f} J")
    cheapest, dearest = (
        min(energies, key=energies.__getitem__),
        max(energies, key=energies.__getitem__),
    )
    print(f"cheapest {cheapest}, dearest {dearest}")


# the processes import this module, too
if __name__ == "__main__":
    main()
