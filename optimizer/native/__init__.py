"""The C library that all arms share, and where the kernels that this machine compiles are kept."""
