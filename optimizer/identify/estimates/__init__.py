"""Least squares over groups of rows, and how well their results are known."""
