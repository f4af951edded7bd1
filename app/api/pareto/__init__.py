"""`POST /pareto`: energy over duration."""
