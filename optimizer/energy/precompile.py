"""`python -m optimizer.energy.precompile [ROBOT …]` compiles the kernels of robots, so that no request is interpreted.

Without a name it compiles those of all robots.
"""

from __future__ import annotations

import sys

from models.registry import load_robot, robot_names
from optimizer.energy.kernel_cache import compile_kernel

if __name__ == "__main__":
    for name in sys.argv[1:] or robot_names():
        print(compile_kernel(load_robot(name)))
