"""C that this machine compiles once: where its libraries are kept, and the small library that every arm shares."""
