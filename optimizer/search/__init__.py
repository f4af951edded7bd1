"""Branch and bound over candidates: ends, lower bounds, incumbent, refinement, baselines."""
