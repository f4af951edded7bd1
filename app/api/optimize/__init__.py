"""`POST /optimize`: the motion of least energy."""
