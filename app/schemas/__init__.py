"""The HTTP contract as pydantic models: types, units, ranges, examples."""
