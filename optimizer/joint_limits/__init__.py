"""Limits on speed and acceleration, derived from the torque limits."""
