"""Readers of files that users upload: they count what they read, and can be stopped while they
do."""
