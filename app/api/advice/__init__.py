"""`/advice`: changes of a task that need less energy, each of them computed."""
