"""Work on jobs: takes their requests from the database, runs them, and stores what came of it."""
