"""One folder per endpoint: its request and answer, the task of a worker, and the route."""
