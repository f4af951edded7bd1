"""Finds motions of least energy: the problem, the search, its bounds and the certificate."""
