"""`/figures`: figures of a robot that were identified on one arm."""
