"""Covers of all configurations of a pose by boxes, for lower bounds."""
