"""The SQL database: studies, their iterations, and stored answers."""
