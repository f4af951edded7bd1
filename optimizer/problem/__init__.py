"""What is asked: frozen, validated data that computes nothing."""
