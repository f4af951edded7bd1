"""Motions that tell an arm's parameters apart: excitation trajectories."""
