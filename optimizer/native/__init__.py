"""The C library shared by all arms, and the cache of the kernels compiled on this machine."""
