"""The C code of the kernels: for any number of nodes, singly or in parallel, results are bitwise
equal to the virtual machine's.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from joulepath.optimizer.dynamics.kernel_cache import COMPILER_FLAGS
from joulepath.optimizer.dynamics.kernel_expressions import SYMBOLICS, build, sizes
from joulepath.optimizer.dynamics.kernel_functions import Compiled, Interpreted
from joulepath.optimizer.dynamics.kernel_source import source, widest_vectors
from joulepath.optimizer.native.build import compiler
from tests.optimizer.dynamics.kernel_states import states
from tests.optimizer.moves import ROBOT
from tests.selection import long_but

pytestmark = pytest.mark.usefixtures("compiler")
PARAMETERS = sizes(ROBOT.nq)["torque"][0][1]


def library(functions: list[ca.Function], lanes: int, folder: Path) -> Path:
    """The functions compiled for `lanes` nodes at once, without optimisation, with the vectors of
    this processor.
    """
    code, target = folder / "kernel.c", folder / "kernel.so"
    code.write_text(source(functions, lanes))
    command = compiler()
    assert command is not None
    own = widest_vectors()
    how = [*COMPILER_FLAGS, *(own.flags if own.lanes == lanes else ()), "-O0"]
    subprocess.run([command, *how, str(code), "-o", str(target), "-lm"], check=True)
    return target


@pytest.mark.parametrize("lanes", long_but([1, 4], [1, 2, 4, 8]))
def test_any_number_of_nodes_is_as_in_the_virtual_machine(lanes: int, tmp_path: Path) -> None:
    functions = [each for each in build(ROBOT) if each.name() in ("torque", "value")]
    compiled, interpreted = (
        Compiled(library(functions, lanes, tmp_path), ROBOT.nq),
        Interpreted(functions),
    )
    rng = np.random.default_rng(lanes)
    p = rng.uniform(0.1, 1.0, PARAMETERS)
    for count in range(1, 2 * lanes + 2):
        y = states(count, count)
        for function in functions:
            mine, theirs = (
                each.evaluation(function.name(), count)(y, p) for each in (compiled, interpreted)
            )
            for result, expected in zip(mine, theirs, strict=True):
                assert (result == expected).all()


def test_a_library_is_unloaded_with_its_last_evaluation(tmp_path: Path) -> None:
    path = library([each for each in build(ROBOT) if each.name() == "torque"], 2, tmp_path)

    def loaded() -> bool:
        return str(path) in Path("/proc/self/maps").read_text()

    evaluation = Compiled(path, ROBOT.nq).evaluation("torque", 3)
    assert loaded()
    (tau,) = evaluation(states(3, 3), np.ones(PARAMETERS))
    assert np.isfinite(tau).all()
    del evaluation
    assert not loaded()


def test_an_operation_that_is_not_known_is_refused() -> None:
    with SYMBOLICS:
        x, p = ca.SX.sym("x"), ca.SX.sym("p")
        strange = ca.Function("strange", [x, p], [ca.erf(x * p)])
        with pytest.raises(NotImplementedError, match="strange"):
            source([strange], 2)
