"""`POST /placement`: the place of the robot for cycles of least energy."""
