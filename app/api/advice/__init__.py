"""`/advice`: computed changes of a task with lower energy."""
