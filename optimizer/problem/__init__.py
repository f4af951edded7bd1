"""Problems as frozen, validated data without computations."""
