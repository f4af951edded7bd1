"""`GET /answers`: kept answers."""
