/* The library that all arms share, as one translation unit: see shared_library.py.

   build.py compiles it and defines SOURCES_DIGEST. */

#include "vectors.c"

#include "chain.c"
#include "distances.c"
#include "clearance_check.c"
#include "grid_points.c"
#include "least_potential.c"
#include "speed_conjugate.c"

/* The digest of the files that it was compiled from. */
const char *sources_digest(void) { return SOURCES_DIGEST; }
