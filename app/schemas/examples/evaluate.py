"""The answer of POST /evaluate as CSV."""

from __future__ import annotations

CSV_TABLE = (
    "segment,start,end,electrical.total,…,balance_error\n1,0.0,1.5,53.1,…,9e-16\n2,1.5,3.0,99.8,…,7e-16\n"
    "total,0.0,3.0,152.9,…,9e-16\n"
)
"""The start of an answer as CSV."""
