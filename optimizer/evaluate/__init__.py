"""Evaluation of given motions: their energy, and their use of the limits."""
