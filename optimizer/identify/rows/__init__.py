"""What fits see of logs: rows, the moves and motions that they belong to, and what is held out."""
