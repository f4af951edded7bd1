"""One folder per endpoint: what it answers, the task of a worker, and the route."""
