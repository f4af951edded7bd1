"""The HTTP contract as pydantic models."""
