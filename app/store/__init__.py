"""What the service remembers: studies, their iterations, and answers kept by reference, in an SQL database."""
