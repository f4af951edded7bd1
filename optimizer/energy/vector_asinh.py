"""asinh of a vector of numbers as C, from additions, multiplications, divisions, roots and bits alone.

With a = |x|, asinh a = log(1 + u), u = a + a² / (1 + sqrt(1 + a²)); where a² could overflow, log a + log 2. As log1p of
fdlibm has it, 1 + u is rounded to f, and f = 2^k (1 + t) with 1 + t in [sqrt(1/2), sqrt(2)):

    log(1 + u) = k log 2 + log(1 + t) + (1 + u - f) / f,
    log(1 + t) = 2 atanh s = t - t²/2 + s (t²/2 + R),     s = t / (2 + t),  R = 2 s² / 3 + 2 s⁴ / 5 + ...

|s| < 0.172, so that TERMS of R leave less than a tenth of a rounding. The result is within ERROR, and alike on all
processors. It is nan where x is infinite.
"""

from __future__ import annotations

# of the series; of the result, relative
TERMS = 10
ERROR = 4 * 2.0**-53


def source() -> str:
    """The C function `lanes_asinh`, and `choose`, which takes a number where the bits of a mask are set, else another.

    `lanes` and `bits` are vectors of doubles and of their bits, `every` fills one with a number, `lanes_sqrt` takes
    roots.
    """
    series = "every(0.0)"
    for n in reversed(range(TERMS)):
        series = f"z * (every(2.0 / {2 * n + 3}) + {series})"
    return f"""static inline lanes choose(bits mask, lanes a, lanes b) {{
  return (lanes)((mask & (bits)a) | (~mask & (bits)b));
}}
static inline lanes lanes_asinh(lanes x) {{
  const long long least = 0x3fe6a09e667f3bcd, one = 0x3ff0000000000000, shift = 0x4338000000000000;
  bits sign = (bits)x & (bits)every(-0.0);
  lanes a = (lanes)((bits)x ^ sign);
  bits large = (bits)(a > every(0x1p60));
  lanes u = choose(large, a, a + a * a / (every(1.0) + lanes_sqrt(every(1.0) + a * a)));
  lanes f = every(1.0) + u;
  lanes rounded = choose((bits)(u > every(1.0)), every(1.0) - (f - u), u - (f - every(1.0))) / f;
  bits scaled = (bits)f + (one - least);
  /* an integer in the last bits of a number of known exponent */
  lanes k = (lanes)((scaled >> 52) - 0x3ff + shift) - every(0x1.8p52);
  lanes t = (lanes)((scaled & 0x000fffffffffffff) + least) - every(1.0);
  lanes s = t / (every(2.0) + t), z = s * s, half = every(0.5) * t * t;
  lanes R = {series};
  /* log 2 in two parts, of which the first times k is exact */
  lanes low = s * (half + R) + (k * every(0x1.a39ef35793c76p-33) + rounded);
  lanes y = k * every(0x1.62e42fee00000p-1) - ((half - low) - t);
  return (lanes)((bits)(y + choose(large, every(0x1.62e42fefa39efp-1), every(0.0))) | sign);
}}
"""
