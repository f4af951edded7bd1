"""With a payload and an obstacle: the cheapest of several places to put the payload down.

python -m examples.library.several_targets
"""

from __future__ import annotations

import numpy as np

from joulepath import AnyOf, Arm, Box, Obstacle, Payload, Pose, Problem, Scene, load_robot, optimize


def pointing_down(x: float, y: float, z: float) -> Pose:
    """The pose of a TCP at a position [m] whose z axis points down."""
    return Pose.from_rotvec([x, y, z], [np.pi, 0.0, 0.0])


T_base_wall = np.eye(4)
T_base_wall[:3, 3] = 0.5, 0.0, 0.15
wall = Obstacle("wall", Box(np.array([0.3, 0.04, 0.3])), T_base_wall, margin=0.01)
arm = Arm(
    robot=load_robot("ur5e"),
    payload=Payload(mass=2.0, com=np.array([0.0, 0.0, 0.05])),
    scene=Scene([wall]),
)
start = pointing_down(0.45, 0.3, 0.2)
places = [pointing_down(x, -0.3, 0.2) for x in (0.35, 0.45, 0.55)]

# without full-turn alternatives, which would make some forty times as many candidates
problem = Problem(arm=arm, start=start, goal=AnyOf(tuple(places)), windings=False, deadline=300.0)

solution = optimize(problem)

clearance = solution.certificate.clearance
assert clearance is not None  # the scene has an obstacle
print(
    f"{solution.status}: place {solution.goal.target + 1} of {len(places)}, by branch "
    f"{solution.goal.label}"
)
print(f"{solution.energy.electrical.total:.1f} J in {solution.duration:.2f} s")
print(
    f"proven clearance beyond the margins: {1000 * clearance.min_clearance:.1f} mm, "
    f"{' and '.join(clearance.pair)}"
)
solved = [candidate for candidate in solution.candidates if candidate.status == "solved"]
print(f"{len(solved)} of {len(solution.candidates)} candidates solved, the others ruled out")
