"""Uncertainty of a robot's figures, and the document of figures identified on one arm."""
