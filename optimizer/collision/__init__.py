"""Bodies, signed distances, the clearance proof in continuous time, and the path planner."""
