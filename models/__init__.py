"""Robots: their figures, each with a source, and the loader. Knows nothing of optimisation or
HTTP."""
