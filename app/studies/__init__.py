"""Progress, suggestions and histories of studies."""
