"""The per-node functions as C that evaluates several nodes at once, one in each lane of the processor's vectors.

CasADi's own C does one node after the other, in four to eight times as long. The operations are the same and in the
same order: so are the results, to the last bit where no friction needs asinh. The C library's has no vectors of these
processors, and took half of all the time. Here it is made of vector operations, within `vector_asinh.ERROR`.
"""

from __future__ import annotations

from pathlib import Path

import casadi as ca

from optimizer.energy import vector_asinh

# numbers per vector, and what the compiler must be told: for every processor of this kind, and for one with AVX2
Vectors = tuple[int, tuple[str, ...]]
PORTABLE: Vectors = (2, ())
AVX2: Vectors = (4, ("-mavx2",))
_CPU = Path("/proc/cpuinfo")

_CALLS = {ca.OP_SQRT: "sqrt", ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_FABS: "fabs"}
_OPERATIONS = {
    ca.OP_ADD: "{} + {}",
    ca.OP_SUB: "{} - {}",
    ca.OP_MUL: "{} * {}",
    ca.OP_DIV: "{} / {}",
    ca.OP_NEG: "-{}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "every(1.0) / {}",
    ca.OP_ASSIGN: "{}",
    **{operation: f"lanes_{name}({{}})" for operation, name in _CALLS.items()},
    ca.OP_ASINH: "lanes_asinh({})",
}
_HEAD = """#include <math.h>
typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef long long bits __attribute__((vector_size(8 * LANES)));
static inline lanes every(double x) { lanes y; for (int i = 0; i < LANES; ++i) y[i] = x; return y; }
static inline void take(const double *rows, long size, long first, long count, lanes *x) {
  for (int i = 0; i < LANES; ++i) {
    const double *row = rows + size * (first + i < count ? first + i : count - 1);
    for (long j = 0; j < size; ++j) x[j][i] = row[j];
  }
}
static inline void give(const lanes *y, long size, long first, long count, double *rows) {
  for (int i = 0; i < LANES && first + i < count; ++i)
    for (long j = 0; j < size; ++j) rows[size * (first + i) + j] = y[j][i];
}
"""


def vectors() -> Vectors:
    """The longest vectors of this machine's processor."""
    try:
        return AVX2 if " avx2 " in _CPU.read_text().replace("\n", " ") else PORTABLE
    except OSError:
        return PORTABLE


def source(functions: list[ca.Function], count: int) -> str:
    """C for CasADi functions of scalar expressions, `count` nodes at once.

    Each becomes `void name(long nodes, const double *const *x, double *const *y)`: all arguments but the last one, and
    all results, have a row for each node; the last argument is the same for all.

    Raises NotImplementedError for an operation that is not known here.
    """
    calls = [
        f"static inline lanes lanes_{name}(lanes x) "
        f"{{ lanes y; for (int i = 0; i < LANES; ++i) y[i] = {name}(x[i]); return y; }}\n"
        for name in _CALLS.values()
    ]
    helpers = [f"#define LANES {count}\n", _HEAD, *calls, vector_asinh.source()]
    return "".join([*helpers, *(_of(function) for function in functions)])


def _of(function: ca.Function) -> str:
    """C for one function: of one vector of nodes, then of any number of nodes."""
    name, inputs, outputs = function.name(), range(function.n_in()), range(function.n_out())
    given, found = [function.numel_in(i) for i in inputs], [function.numel_out(i) for i in outputs]
    shared = inputs[-1]
    body = "\n".join(_instruction(function, k) for k in range(function.n_instructions()))
    return f"""
static void {name}_of_one({", ".join([f"const lanes *x{i}" for i in inputs] + [f"lanes *y{i}" for i in outputs])}) {{
lanes {", ".join(f"w{i}" for i in range(function.sz_w()))};
{body}
}}
void {name}(long count, const double *const *x, double *const *y) {{
lanes {", ".join([f"x{i}[{n}]" for i, n in enumerate(given)] + [f"y{i}[{n}]" for i, n in enumerate(found)])};
for (int j = 0; j < {given[shared]}; ++j) x{shared}[j] = every(x[{shared}][j]);
for (long first = 0; first < count; first += LANES) {{
{" ".join(f"take(x[{i}], {given[i]}, first, count, x{i});" for i in inputs if i != shared)}
{name}_of_one({", ".join([f"x{i}" for i in inputs] + [f"y{i}" for i in outputs])});
{" ".join(f"give(y{i}, {found[i]}, first, count, y[{i}]);" for i in outputs)}
}}
}}
"""


def _instruction(function: ca.Function, k: int) -> str:
    """One step of a function's algorithm on its work variables w, as CasADi's virtual machine takes it."""
    operation, given, found = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
    if operation == ca.OP_CONST:
        return f"w{found[0]} = every({function.instruction_constant(k)!r});"
    if operation == ca.OP_INPUT:
        return f"w{found[0]} = x{given[0]}[{given[1]}];"
    if operation == ca.OP_OUTPUT:
        return f"y{found[0]}[{found[1]}] = w{given[0]};"
    if operation not in _OPERATIONS:
        raise NotImplementedError(f"{function.name()} has an operation that the C source does not know: {operation}")
    return f"w{found[0]} = {_OPERATIONS[operation].format(*(f'w{i}' for i in given))};"
