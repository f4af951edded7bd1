"""Results of searches as frozen data; every field declares its unit and meaning."""
