"""Jobs against their goals. The exit code is 1 if one is missed.

    python -m benchmarks.jobs
    python -m benchmarks.jobs --only overhead --small 10000 --count 500
    python -m benchmarks.jobs --only kills --kills 20 --count 500

- overhead: time that a worker is not at work on a request although the job has more, per request: (time of the job ×
  workers for jobs − sum of the times that the workers measure) / requests. Once for small requests (`/evaluate`), once
  for random ones (`/optimize`). Also the processor time of the service's own process, and the size of the SQLite file.
- interactive: wall time of requests that a client waits for, one after another, without and beside a running job.
- kills: `kill -9` of the service at random instants of a job. Every request must be answered once, and no event may be
  lost or come twice.
- cluster: overhead of small and of random requests through Dask, with a scheduler and one machine beside the service.
- cancel: time from a cancel to the end of the process that works on the job.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.command import parser, write_json
from benchmarks.service import COMPUTED, START, Client, Service, a_cluster, processor_time, running
from benchmarks.statistics import Spread
from benchmarks.tasks import request_task
from joulepath.app.schemas.examples.values import HOME, NEAR

MOST_OVERHEAD = 3e-3  # [s] per request
MOST_CLUSTER_OVERHEAD = 10e-3  # [s] per request
MOST_BYTES = 60_000  # per request
MOST_SLOWDOWN = 1.5  # of the 95th percentile
MOST_CANCEL = 1.0  # [s]
WORKERS = 2

Results = dict[str, Any]


def small(count: int) -> list[Results]:
    """Requests of a few milliseconds, all different."""
    return [{"evaluate": {"configurations": [HOME, NEAR], "time_per_segment": 1 + 1e-4 * k}} for k in range(count)]


def random(seed: int, count: int) -> list[Results]:
    """Random requests with default settings."""
    return [{"optimize": request_task(seed, index).body} for index in range(count)]


def send(client: Client, requests: list[Results], **headers: str) -> str:
    """The path of a new job."""
    return str(client.post("/jobs", {"requests": requests}, **headers).headers["location"])


def wait(client: Client, path: str) -> Results:
    """A job after its end, without its requests."""
    while True:
        job: Results = client.get(f"{path}?limit=1").content
        if job["state"] in ("done", "cancelled"):
            return job
        time.sleep(0.2)


def statuses(client: Client, path: str) -> list[Results]:
    """All requests of a job."""
    found: list[Results] = []
    after: int | None = -1
    while after is not None:
        page = client.get(f"{path}?limit=1000&after={after}").content
        found, after = found + page["requests"], page["next"]
    return found


def overhead_of(requests: list[Results], workers_for_jobs: int, **environment: str) -> Results:
    """Overhead [s], processor time of the service's own process [s], and bytes on the disk, each per request."""
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{folder}/jobs.db"
        settings: dict[str, Any] = {"JOULEPATH_WORKERS": f"{WORKERS}", "JOULEPATH_JOB_WORKERS": f"{workers_for_jobs}"}
        settings |= environment
        with running(JOULEPATH_DATABASE_URL=url, **settings) as service, closing(service.client()) as client:
            wait(client, send(client, requests[:4]))  # kernels and caches are warm
            empty, used = _size(folder), processor_time(service.process.pid)
            began = time.perf_counter()
            path = send(client, requests)
            accepted = time.perf_counter() - began
            job = wait(client, path)
            used = processor_time(service.process.pid) - used
            found = statuses(client, path)
        # the service has ended, and the log of SQLite is in the file
        size = _size(folder) - empty
    elapsed = time_of(job)
    work = sum(each["wall_time"] for each in found)
    count = len(requests)
    return {
        "requests": count,
        "workers_for_jobs": workers_for_jobs,
        "accepted": accepted,
        "elapsed": elapsed,
        "counts": job["counts"],
        "work": work / count,
        "overhead": (elapsed * workers_for_jobs - work) / count,
        "service_processor_time": used / count,
        "bytes": size / count,
    }


def _size(folder: str) -> int:
    return sum(file.stat().st_size for file in Path(folder).iterdir())


def time_of(job: Results) -> float:
    """Time [s] from the start of a job to its end."""
    start, end = (np.datetime64(job[name].rstrip("Z")) for name in ("started", "ended"))
    return float((end - start) / np.timedelta64(1, "s"))


def _overheads(given: Any, workers_for_random: int, **environment: str) -> list[Results]:
    """Prints and returns the overhead of small and of random requests."""
    print(f"{'requests':16} {'workers':>8} {'work':>9} {'overhead':>9} {'service':>9} {'on disk':>9}   accepted in")
    rows = []
    small_ones, random_ones = small(given.small), random(given.seed, given.count)
    cases = [] if environment else [("small", small_ones, 1)]
    cases += [("small", small_ones, WORKERS), ("random", random_ones, workers_for_random)]
    for name, requests, workers in cases:
        row = overhead_of(requests, workers, **environment)
        rows.append(row)
        times = " ".join(f"{1e3 * row[key]:6.2f} ms" for key in ("work", "overhead", "service_processor_time"))
        end = f"{1e-3 * row['bytes']:6.1f} kB   {row['accepted']:.2f} s"
        print(f"{len(requests)} {name}".ljust(16), f"{workers:8} {times} {end}", flush=True)
    return rows


def overhead(given: Any) -> tuple[Results, bool]:
    """Prints and returns the overhead of requests in the service's own workers."""
    rows = _overheads(given, 1)
    held = all(row["overhead"] <= MOST_OVERHEAD and row["bytes"] <= MOST_BYTES for row in rows)
    print(f"goals: overhead at most {1e3 * MOST_OVERHEAD:g} ms, at most {1e-3 * MOST_BYTES:g} kB on the disk")
    return {"rows": rows}, held


def cluster(given: Any) -> tuple[Results, bool]:
    """Prints and returns the overhead of requests on a cluster of one machine, whose workers are as many."""
    with a_cluster(WORKERS) as address:
        rows = _overheads(given, WORKERS, JOULEPATH_CLUSTER=address)
    held = all(row["overhead"] <= MOST_CLUSTER_OVERHEAD for row in rows)
    print(f"goal: overhead at most {1e3 * MOST_CLUSTER_OVERHEAD:g} ms")
    return {"rows": rows}, held


def interactive(given: Any) -> tuple[Results, bool]:
    """Prints and returns the wall times of requests that a client waits for."""
    # turns, because the load of a shared machine changes
    idle: list[float] = []
    beside: list[float] = []
    bodies = [request_task(given.seed + 1, index).body for index in range(given.answers)]
    # made before: a connection that rests meanwhile is closed
    job = random(given.seed, given.beside)
    with running(JOULEPATH_WORKERS=f"{WORKERS}") as service, closing(service.client()) as client:
        for turn in range(given.turns):
            part = bodies[turn :: given.turns]
            idle += [client.optimize(body).wall for body in part]
            path = send(client, job, **COMPUTED)
            beside += [client.optimize(body).wall for body in part]
            assert client.get(f"{path}?limit=1").content["state"] == "running", "the job is too short"
            client.post(f"{path}/cancel", {})
            wait(client, path)
            service.wait("/readyz")
            time.sleep(1.0)  # the killed worker is replaced
    spreads = {"idle": Spread.of(idle), "beside a job": Spread.of(beside)}
    for name, spread in spreads.items():
        print(f"{name:14} {spread.times(1e3).formatted(' ms', 0)}")
    ratio = spreads["beside a job"].p95 / spreads["idle"].p95
    print(f"95th percentile beside a job / idle: {ratio:.2f}, goal: at most {MOST_SLOWDOWN:g}")
    return {name: asdict(spread) for name, spread in spreads.items()} | {"ratio": ratio}, ratio <= MOST_SLOWDOWN


def kills(given: Any) -> tuple[Results, bool]:
    """Prints and returns what is left of a job whose service is killed again and again."""
    rng = np.random.default_rng(given.seed)
    requests = [small(given.count)[k] if k % 4 else each for k, each in enumerate(random(given.seed, given.count))]
    path, progress = "", list[float]()
    with tempfile.TemporaryDirectory() as folder:
        settings: dict[str, Any] = {
            "JOULEPATH_DATABASE_URL": f"sqlite:///{folder}/jobs.db",
            "JOULEPATH_WORKERS": f"{WORKERS}",
        }
        for _ in range(given.kills):
            with running(**settings) as service, closing(service.client()) as client:
                path = path or send(client, requests)
                time.sleep(rng.uniform(0.0, given.longest))
                progress.append(client.get(f"{path}?limit=1").content["progress"])
                service.process.kill()
                service.process.wait()
        with running(**settings) as service, closing(service.client()) as client:
            job = wait(client, path)
            found = statuses(client, path)
            events = client.get(f"{path}/events").raw.decode()
            answers = {client.get(each["answer"]).content["answer"]["id"] for each in found if each["answer"]}
    numbers = [int(line[4:]) for line in events.splitlines() if line.startswith("id: ")]
    ended = events.count("event: request\n")
    held = (
        job["counts"]["done"] + job["counts"]["failed"] == len(requests) == ended
        and len(answers) == job["counts"]["done"]
        and numbers == list(range(1, len(numbers) + 1))
    )
    print(f"{given.kills} kills at {', '.join(f'{100 * each:.0f} %' for each in progress)} of {len(requests)} requests")
    print(f"{job['counts']['done']} done, {job['counts']['failed']} failed, {len(answers)} different answers, ", end="")
    print(f"{ended} ends among {len(numbers)} events without a gap: {'yes' if held else 'NO'}")
    return {"progress": progress, "counts": job["counts"], "answers": len(answers), "ended": ended}, held


def cancel(given: Any) -> tuple[Results, bool]:
    """Prints and returns the times from a cancel to the end of the process that works on the job."""
    hard = {"optimize": {**random(given.seed, 1)[0]["optimize"], "deadline": 100.0}}
    hard["optimize"] |= {"objective": "mechanical", "duration": {"max": 600.0}, "start": {"pose": _POSE}}
    hard["optimize"]["sample_period"] = 0.05  # an answer has 20,000 samples at most
    times = []
    with running(JOULEPATH_WORKERS=f"{WORKERS}") as service, closing(service.client()) as client:
        for _ in range(given.cancels):
            _settle(service)
            before = {pid: processor_time(pid) for pid in service.worker_pids()}
            path = send(client, [hard], **COMPUTED)
            _until_at_work(before)
            began = time.perf_counter()
            client.post(f"{path}/cancel", {})
            while all(_runs(pid) for pid in before):
                time.sleep(1e-3)
            times.append(time.perf_counter() - began)
            wait(client, path)
    print(f"cancel to end of the process: {Spread.of(times).times(1e3).formatted(' ms', 0)}; goal: below 1000 ms")
    return {"times": times}, max(times) <= MOST_CANCEL


_POSE = {"position": [0.4, 0.2, 0.35], "quaternion": [0.0, 1.0, 0.0, 0.0]}


def _settle(service: Service) -> None:
    """Waits until all workers are there and none is at work."""
    before: dict[int, float] = {}
    while True:
        now = {pid: processor_time(pid) for pid in service.worker_pids()}
        # the process that workers are forked from is one more
        if len(now) == WORKERS + 1 and now == before:
            return
        before = now
        time.sleep(0.5)


def _until_at_work(before: dict[int, float]) -> None:
    end = time.perf_counter() + START
    while time.perf_counter() < end:
        if any(processor_time(pid) > used + 0.2 for pid, used in before.items()):
            return
        time.sleep(0.01)
    raise RuntimeError("no worker works on the job")


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


SECTIONS: dict[str, Callable[[Any], tuple[Results, bool]]] = {
    "overhead": overhead,
    "cluster": cluster,
    "interactive": interactive,
    "kills": kills,
    "cancel": cancel,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit code."""
    command = parser(__doc__, seed=11)
    command.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="sections (all)")
    command.add_argument("--small", type=int, default=2000, help="small requests (%(default)s)")
    command.add_argument("--count", type=int, default=200, help="random requests (%(default)s)")
    command.add_argument("--answers", type=int, default=200, help="requests that a client waits for (%(default)s)")
    command.add_argument("--turns", type=int, default=4, help="changes between idle and beside a job (%(default)s)")
    command.add_argument("--beside", type=int, default=2000, help="requests of the job beside (%(default)s)")
    command.add_argument("--kills", type=int, default=20, help="kills (%(default)s)")
    command.add_argument("--longest", type=float, default=3.0, help="longest time until a kill [s] (%(default)s)")
    command.add_argument("--cancels", type=int, default=10, help="cancels (%(default)s)")
    given = command.parse_args(arguments)
    results, held = {}, []
    for name in given.only:
        print(f"{name}:")
        results[name], good = SECTIONS[name](given)
        held.append(good)
    write_json(given.json, results)
    return int(not all(held))


if __name__ == "__main__":
    sys.exit(main())
