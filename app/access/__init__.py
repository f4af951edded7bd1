"""Who sends a request, and what this client may do."""
