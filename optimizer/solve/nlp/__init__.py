"""The nonlinear program of one candidate, and its SQP solver."""
