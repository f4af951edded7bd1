"""Collision-free joint paths by a sampling planner."""
