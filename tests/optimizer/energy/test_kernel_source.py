"""The C of the kernels: any number of nodes, several at once, as the virtual machine has it.

What has no friction is the same to the last bit: only asinh is another one.
"""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from optimizer.energy.kernel_expressions import SYMBOLICS, build, sizes
from optimizer.energy.kernel_functions import Compiled, Interpreted
from optimizer.energy.kernel_source import source
from tests.optimizer.energy.compiled_source import library
from tests.optimizer.energy.kernel_states import states
from tests.optimizer.moves import ROBOT

PARAMETERS = sizes(ROBOT.nq)["torque"][0][1]
# what an error of some roundings in asinh makes of costs and torques, relative to their greatest
ROUNDED = 1e-14


@pytest.mark.parametrize("lanes", [1, 2, 4, 8])
def test_any_number_of_nodes_is_as_in_the_virtual_machine(lanes: int, tmp_path: Path) -> None:
    functions = [each for each in build(ROBOT) if each.name() in ("torque", "value")]
    compiled, interpreted = Compiled(library(functions, lanes, tmp_path), ROBOT.nq), Interpreted(functions)
    rng = np.random.default_rng(lanes)
    p = rng.uniform(0.1, 1.0, PARAMETERS)
    for count in range(1, 2 * lanes + 2):
        y = states(count, count)
        for function in functions:
            mine, theirs = (each.evaluation(function.name(), count)(y, p) for each in (compiled, interpreted))
            for result, expected in zip(mine, theirs, strict=True):
                error = np.abs(result - expected).max()
                assert error <= (0.0 if function.name() == "torque" else ROUNDED * np.abs(expected).max())


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
