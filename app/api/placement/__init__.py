"""`POST /placement`: where to put the robot, for cycles of least energy."""
