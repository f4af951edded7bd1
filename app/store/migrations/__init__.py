"""Changes of the database's tables, for alembic."""
