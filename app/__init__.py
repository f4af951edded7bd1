"""The HTTP service: parses, calls the optimizer in worker processes, answers. No physics."""

__version__ = "0.1.0"
