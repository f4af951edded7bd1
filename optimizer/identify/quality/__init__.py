"""How good a fit is: intervals, errors on moves that it has not seen, what the logs tell,
advice."""
