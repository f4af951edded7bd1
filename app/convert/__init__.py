"""Translation between the schemas and the dataclasses of the library, in both directions."""
