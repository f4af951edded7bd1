"""Work on jobs: requests are leased from the database, run, and their outcomes stored."""
