"""Parameters, dependencies and ways of answering that several routes share."""
