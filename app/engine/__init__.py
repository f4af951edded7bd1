"""Where CPU work runs: worker processes behind a bounded queue, each task with a deadline."""
