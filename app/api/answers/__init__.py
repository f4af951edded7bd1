"""`GET /answers`: answers that the service keeps."""
