"""Placement of least energy: where to put the robot, or the stops and obstacles around it."""
