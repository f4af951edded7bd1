"""`/tools`: grippers by name."""
