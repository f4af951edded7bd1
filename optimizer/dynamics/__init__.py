"""Torques, losses, the power bus, and the compiled kernel."""
