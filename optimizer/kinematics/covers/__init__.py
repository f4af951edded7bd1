"""Boxes that cover all configurations of a pose, for lower bounds."""
