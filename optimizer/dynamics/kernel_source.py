"""The per-node functions as C that evaluates several nodes at once, one in each lane of the
processor's vectors.

CasADi's own C does one node after the other, and takes two to three times as long for the
derivatives. The operations are the same and in the same order: so are the results, to the last bit.
"""

from __future__ import annotations

from pathlib import Path

import casadi as ca

# numbers per vector, and what the compiler must be told: for every processor of this kind, and for
# one with AVX2
Vectors = tuple[int, tuple[str, ...]]
PORTABLE: Vectors = (2, ())
AVX2: Vectors = (4, ("-mavx2",))
_CPU = Path("/proc/cpuinfo")

# what processors have an instruction for, and what the C library computes, one number at a time
_INSTRUCTIONS = {ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs"}
_CALLS = {ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_ASINH: "asinh"}
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
    **{operation: f"lanes_{name}({{}})" for operation, name in (_INSTRUCTIONS | _CALLS).items()},
}
# Some functions of the C library are code for processors without AVX, which waits for the upper
# halves of vector registers unless they are cleared: an asinh takes ten times as long. No vector
# may be in a register then, so the call goes by memory and is never inlined
_HEAD = """#include <math.h>
#ifdef __AVX__
#define CLEAR_UPPER_HALVES __builtin_ia32_vzeroupper()
#else
#define CLEAR_UPPER_HALVES
#endif
typedef double lanes __attribute__((vector_size(8 * LANES)));
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
        return (
            AVX2
            if " avx2 " in _CPU.read_text(encoding="utf-8", errors="replace").replace("\n", " ")
            else PORTABLE
        )
    except OSError:
        return PORTABLE


def source(functions: list[ca.Function], count: int) -> str:
    """C for CasADi functions of scalar expressions, `count` nodes at once.

    Each becomes `void name(long nodes, const double *const *x, double *const *y)`: all arguments
    but the last one, and all results, have a row for each node; the last argument is the same for
    all.

    Raises NotImplementedError for an operation that is not known here.
    """
    instructions = [
        f"static inline lanes lanes_{name}(lanes x) "
        f"{{ lanes y; for (int i = 0; i < LANES; ++i) y[i] = {name}(x[i]); return y; }}\n"
        for name in _INSTRUCTIONS.values()
    ]
    calls = map(_call, _CALLS.values())
    return "".join([f"#define LANES {count}\n", _HEAD, *instructions, *calls, *map(_of, functions)])


def _call(name: str) -> str:
    """C for a function of the C library."""
    return f"""
static __attribute__((noinline)) void all_{name}(double *x) {{
  CLEAR_UPPER_HALVES;
  for (int i = 0; i < LANES; ++i) x[i] = {name}(x[i]);
}}
static inline lanes lanes_{name}(lanes x) {{
  union {{ lanes vector; double number[LANES]; }} y = {{ x }};
  all_{name}(y.number);
  return y.vector;
}}
"""


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
"""  # noqa: E501


def _instruction(function: ca.Function, k: int) -> str:
    """One step of a function's algorithm on its work variables w, as CasADi's virtual machine takes
    it.
    """
    operation, given, found = (
        function.instruction_id(k),
        function.instruction_input(k),
        function.instruction_output(k),
    )
    if operation == ca.OP_CONST:
        return f"w{found[0]} = every({function.instruction_constant(k)!r});"
    if operation == ca.OP_INPUT:
        return f"w{found[0]} = x{given[0]}[{given[1]}];"
    if operation == ca.OP_OUTPUT:
        return f"y{found[0]}[{found[1]}] = w{given[0]};"
    if operation not in _OPERATIONS:
        raise NotImplementedError(
            f"{function.name()} has an operation that the C source does not know: {operation}"
        )
    return f"w{found[0]} = {_OPERATIONS[operation].format(*(f'w{i}' for i in given))};"
