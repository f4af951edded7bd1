"""C source of the per-node functions, with several nodes at once in the lanes of SIMD vectors.

CasADi's own C code evaluates one node after the other and takes two to three times as long for the
derivatives. The operations and their order are the same here, so the results agree to the last bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import casadi as ca


@dataclass(frozen=True)
class VectorUnit:
    """SIMD vectors of a processor: numbers per vector, and the compiler flags to use them."""

    lanes: int
    flags: tuple[str, ...]


PORTABLE = VectorUnit(lanes=2, flags=())
"""Vectors of every processor of this architecture."""
AVX2 = VectorUnit(lanes=4, flags=("-mavx2",))
"""Vectors of processors with AVX2."""
_CPU_INFO = Path("/proc/cpuinfo")

# Functions for which processors have a vector instruction.
_INSTRUCTIONS = {ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs"}
# Functions of the C library, called for one number at a time.
_CALLS = {ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_ASINH: "asinh"}
_OPERATIONS = {
    ca.OP_ADD: "{} + {}",
    ca.OP_SUB: "{} - {}",
    ca.OP_MUL: "{} * {}",
    ca.OP_DIV: "{} / {}",
    ca.OP_NEG: "-{}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "broadcast(1.0) / {}",
    ca.OP_ASSIGN: "{}",
    **{operation: f"lanes_{name}({{}})" for operation, name in (_INSTRUCTIONS | _CALLS).items()},
}
# Some functions of the C library use instructions from before AVX, and these stall until the upper
# halves of the vector registers are cleared: an asinh would take ten times as long. No vector may
# be in a register at that time, so the numbers are passed in memory and the call is never inlined.
_C_HEADER = """#include <math.h>
#ifdef __AVX__
#define CLEAR_UPPER_HALVES __builtin_ia32_vzeroupper()
#else
#define CLEAR_UPPER_HALVES
#endif
typedef double lanes __attribute__((vector_size(8 * LANES)));
static inline lanes broadcast(double x) {
  lanes y;
  for (int i = 0; i < LANES; ++i) y[i] = x;
  return y;
}
static inline void load_rows(const double *rows, long size, long first, long count, lanes *x) {
  for (int i = 0; i < LANES; ++i) {
    const double *row = rows + size * (first + i < count ? first + i : count - 1);
    for (long j = 0; j < size; ++j) x[j][i] = row[j];
  }
}
static inline void store_rows(const lanes *y, long size, long first, long count, double *rows) {
  for (int i = 0; i < LANES && first + i < count; ++i)
    for (long j = 0; j < size; ++j) rows[size * (first + i) + j] = y[j][i];
}
"""


def widest_vectors() -> VectorUnit:
    """The widest vectors of this machine's processor."""
    try:
        flags = _CPU_INFO.read_text(encoding="utf-8", errors="replace").replace("\n", " ")
    except OSError:
        return PORTABLE
    return AVX2 if " avx2 " in flags else PORTABLE


def source(functions: list[ca.Function], lanes: int) -> str:
    """C code of CasADi functions of scalar expressions, for `lanes` nodes at once.

    Each function becomes `void name(long nodes, const double *const *x, double *const *y)`. All
    arguments but the last, and all results, have one row per node; all nodes share the last
    argument.

    Raises:
        NotImplementedError: a function has an operation without C code here.
    """
    instructions = [
        f"static inline lanes lanes_{name}(lanes x) "
        f"{{ lanes y; for (int i = 0; i < LANES; ++i) y[i] = {name}(x[i]); return y; }}\n"
        for name in _INSTRUCTIONS.values()
    ]
    calls = map(_library_call, _CALLS.values())
    code = map(_function_source, functions)
    return "".join([f"#define LANES {lanes}\n", _C_HEADER, *instructions, *calls, *code])


def _library_call(name: str) -> str:
    """C code that applies a function of the C library to every lane."""
    return f"""
static __attribute__((noinline)) void each_{name}(double *x) {{
  CLEAR_UPPER_HALVES;
  for (int i = 0; i < LANES; ++i) x[i] = {name}(x[i]);
}}
static inline lanes lanes_{name}(lanes x) {{
  union {{ lanes vector; double number[LANES]; }} y = {{ x }};
  each_{name}(y.number);
  return y.vector;
}}
"""


def _function_source(function: ca.Function) -> str:
    """C code of one function: for one vector of nodes, and for any number of nodes."""
    name, inputs, outputs = function.name(), range(function.n_in()), range(function.n_out())
    input_sizes = [function.numel_in(i) for i in inputs]
    output_sizes = [function.numel_out(i) for i in outputs]
    shared = inputs[-1]
    arguments = ", ".join(
        [f"const lanes *x{i}" for i in inputs] + [f"lanes *y{i}" for i in outputs]
    )
    work = ", ".join(f"w{i}" for i in range(function.sz_w()))
    body = "\n".join(_instruction(function, k) for k in range(function.n_instructions()))
    vectors = ", ".join(
        [f"x{i}[{n}]" for i, n in enumerate(input_sizes)]
        + [f"y{i}[{n}]" for i, n in enumerate(output_sizes)]
    )
    loads = [f"load_rows(x[{i}], {input_sizes[i]}, first, count, x{i});" for i in inputs[:-1]]
    names = ", ".join([f"x{i}" for i in inputs] + [f"y{i}" for i in outputs])
    stores = [f"store_rows(y{i}, {output_sizes[i]}, first, count, y[{i}]);" for i in outputs]
    return f"""
static void {name}_vector({arguments}) {{
lanes {work};
{body}
}}
void {name}(long count, const double *const *x, double *const *y) {{
lanes {vectors};
for (int j = 0; j < {input_sizes[shared]}; ++j) x{shared}[j] = broadcast(x[{shared}][j]);
for (long first = 0; first < count; first += LANES) {{
{" ".join(loads)}
{name}_vector({names});
{" ".join(stores)}
}}
}}
"""


def _instruction(function: ca.Function, k: int) -> str:
    """C code of instruction k of a function, on the work variables w of CasADi's virtual machine.

    Raises:
        NotImplementedError: the operation has no C code here.
    """
    operation = function.instruction_id(k)
    operands, results = function.instruction_input(k), function.instruction_output(k)
    if operation == ca.OP_CONST:
        return f"w{results[0]} = broadcast({function.instruction_constant(k)!r});"
    if operation == ca.OP_INPUT:
        return f"w{results[0]} = x{operands[0]}[{operands[1]}];"
    if operation == ca.OP_OUTPUT:
        return f"y{results[0]}[{results[1]}] = w{operands[0]};"
    if operation not in _OPERATIONS:
        raise NotImplementedError(
            f"{function.name()} has an operation that the C source does not know: {operation}"
        )
    return f"w{results[0]} = {_OPERATIONS[operation].format(*(f'w{i}' for i in operands))};"
