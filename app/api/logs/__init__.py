"""`/logs`: recorded motions of an arm."""
