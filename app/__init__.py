"""The HTTP service: parses, calls the optimizer in worker processes, answers. No physics."""
