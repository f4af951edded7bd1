"""Limits on speed and acceleration that the torque limits imply."""
