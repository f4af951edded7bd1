"""Results as JSON, tables, pictures and files, for notebooks and scripts."""
