"""Parameters, dependencies and responses shared by several routes."""
