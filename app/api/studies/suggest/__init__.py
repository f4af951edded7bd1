"""`GET /studies/{id}/suggest`: changes to try next."""
