"""`python -m optimizer.energy.precompile` compiles the kernels of all robots, so that no request is interpreted."""

from __future__ import annotations

from models.registry import load_robot, robot_names
from optimizer.energy.kernel_cache import compile_kernel

if __name__ == "__main__":
    for name in robot_names():
        print(compile_kernel(load_robot(name)))
