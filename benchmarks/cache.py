"""Answers that were computed before, against their goal. The exit code is 1 if it is missed.

    python -m benchmarks.cache

Random requests to `/optimize`, each sent twice over one connection: wall times of the first, which computes, and of the
second, which finds the answer in the database. Then all of them as one job, each three times: time per request.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import asdict

from benchmarks.command import parser, write_json
from benchmarks.jobs import send, time_of, wait
from benchmarks.service import running
from benchmarks.statistics import Spread
from benchmarks.tasks import request_task

MOST_HIT = 5e-3  # [s], median


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    command = parser(__doc__, seed=12)
    command.add_argument("--count", type=int, default=200, help="requests (%(default)s)")
    given = command.parse_args(arguments)
    bodies = [request_task(given.seed, index).body for index in range(given.count)]
    with running(JOULEPATH_WORKERS="1") as service, closing(service.client()) as client:
        computed = [client.post("/optimize", body) for body in bodies]
        # what was not optimal is found, too: the deadline is the same
        again = [client.post("/optimize", body) for body in bodies]
        path = send(client, [{"optimize": body} for body in bodies] * 3)
        job = wait(client, path)
    kept = [index for index, answer in enumerate(computed) if answer.status == 200]
    hits = [index for index in kept if again[index].headers.get("joulepath-cache") == "hit"]
    print(f"{len(kept)} of {len(bodies)} requests have an answer; {len(hits)} were found again")
    spreads = {
        "computed": Spread.of([computed[index].wall for index in kept]),
        "found": Spread.of([again[index].wall for index in hits]),
    }
    for name, spread in spreads.items():
        print(f"{name:10} {spread.times(1e3).formatted(' ms', 1)}")
    copied = time_of(job) / sum(job["counts"].values())
    print(f"as a job, each three times: {1e3 * copied:.1f} ms a request")
    print(f"goal: found in at most {1e3 * MOST_HIT:g} ms, median")
    write_json(given.json, {name: asdict(spread) for name, spread in spreads.items()} | {"copied": copied})
    return int(len(hits) < len(kept) or spreads["found"].p50 > MOST_HIT)


if __name__ == "__main__":
    sys.exit(main())
