"""Worker processes behind a bounded, fair queue; every task has a deadline."""
