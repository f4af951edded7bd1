"""Export of motions as programs and files for robot controllers, one format per file."""
