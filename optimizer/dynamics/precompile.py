"""Compiles the kernels of robots, so that no request uses an interpreted kernel.

    python -m joulepath.optimizer.dynamics.precompile [--portable] [ROBOT …]

Without a name, the kernels of all robots are compiled. With `--portable` they run on every
processor of this architecture, as in an image for many machines; without, they use the vectors of
this machine's processor and are twice as fast.
"""

from __future__ import annotations

import sys

from joulepath.models.registry import robot_names
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.problem.robots import load_robot

if __name__ == "__main__":
    portable = "--portable" in sys.argv
    wanted = [name for name in sys.argv[1:] if name != "--portable"] or robot_names()
    if unknown := set(wanted) - set(robot_names()):
        sys.exit(
            f"There is no robot named {', '.join(sorted(unknown))}: use some of "
            f"{', '.join(robot_names())}."
        )
    try:
        for name in wanted:
            print(compile_kernel(load_robot(name), portable))
    except (RuntimeError, OSError) as error:
        sys.exit(
            f"The kernels cannot be compiled: {error}\nSet CC to a C compiler that works, or "
            "JOULEPATH_CACHE_DIR to a folder for the kernels. The service also works without "
            "them (`make serve JOULEPATH_ROBOTS=`), more slowly."
        )
