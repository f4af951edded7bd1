"""Finds the motion of least energy of a robot arm.

    solution = joulepath.optimize(joulepath.Problem(arm=…, start=…, goal=…))

The public names are those that `__init__.pyi` imports. Each is loaded when it is first used, so
that `import joulepath` takes no time in processes that need only a part of the package.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
