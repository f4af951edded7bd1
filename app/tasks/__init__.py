"""What a worker process does with a request, one file per endpoint."""
