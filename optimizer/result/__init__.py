"""What a search answers, as frozen data; every field declares its unit and meaning."""
