"""One file per version of the database's tables."""
