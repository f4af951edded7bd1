"""The service's own errors."""
