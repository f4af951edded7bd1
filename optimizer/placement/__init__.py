"""Placement of least energy, of the robot or of the stops and obstacles around it."""
