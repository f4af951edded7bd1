"""Attacks on a service over loopback, limited in number and time: memory of the service, and
answers to other clients.

    python -m benchmarks.attacks --only headers meshes
    python -m benchmarks.attacks --soak 1200
    python -m benchmarks.attacks --only mixed --minutes 8 --kill-every 30

During every attack, one client requests `/healthz` forty times a second, and an honest client
optimises short motions. The attacker has another address than these two clients. Crowds of clients
follow the attacks: see `benchmarks.crowds`.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import tempfile
import time
from collections.abc import Awaitable, Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import orjson

from benchmarks.attack_bodies import long_search, meshes, numbers, sampled
from benchmarks.command import parser, write_json
from benchmarks.crowds import CROWDS
from benchmarks.crowds import report as report_crowd
from benchmarks.observed_attack import Attack, Outcome, observed
from benchmarks.service import Client, Service, running

ATTACKER = "127.0.0.66"
END_TIMEOUT = 30.0
"""Longest time until the process of the service has ended [s]."""

Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def connect(port: int) -> Streams:
    """A connection from the attacker's address."""
    return await asyncio.open_connection("127.0.0.1", port, local_addr=(ATTACKER, 0))


def post(path: str, body: bytes, declared: int | None = None) -> bytes:
    """A POST request; `declared` is its Content-Length if it differs from the size of the body."""
    head = (
        f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
        "application/json\r\nCache-Control: no-cache\r\n"
    )
    return f"{head}Content-Length: {declared or len(body)}\r\n\r\n".encode() + body


async def concurrently(count: int, run: Callable[[int], Awaitable[Any]]) -> list[Any]:
    """Results of `count` concurrent calls of `run`, with the exceptions of failed calls."""
    return await asyncio.gather(*(run(index) for index in range(count)), return_exceptions=True)


async def status_of(reader: asyncio.StreamReader) -> int:
    """Status of the next response; 0 if the connection ends first."""
    try:
        return int((await reader.readline()).split()[1])
    except (OSError, IndexError):
        return 0


def counted(values: list[Any]) -> str:
    """The number of occurrences of every value, as text."""
    names = [
        "lost" if isinstance(value, BaseException) or value == 0 else str(value) for value in values
    ]
    return ", ".join(f"{names.count(name)} × {name}" for name in sorted(set(names)))


async def endless_headers(port: int) -> str:
    """Four connections send headers until the service closes them, at most 192 MiB per
    connection."""
    line = b"".join(b"X-%d: " % k + b"a" * 4000 + b"\r\n" for k in range(16))

    async def one(index: int) -> float:
        reader, writer = await connect(port)
        writer.write(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n")
        sent = 0
        with contextlib.suppress(OSError):
            while sent < 192 << 20 and not reader.at_eof():
                writer.write(line)
                await asyncio.wait_for(writer.drain(), 5)
                sent += len(line)
                await asyncio.sleep(0)
        writer.close()
        return sent / 2**20

    return "MiB accepted: " + ", ".join(f"{sent:.1f}" for sent in await concurrently(4, one))


async def half_requests(port: int) -> str:
    """300 connections send half a head and 100 half a body; the open ones are counted after
    15 s."""

    async def one(index: int) -> Streams:
        streams = await connect(port)
        streams[1].write(b"POST /opt" if index < 300 else post("/optimize", b"{", 1000))
        return streams

    opened = [
        streams
        for streams in await concurrently(400, one)
        if not isinstance(streams, BaseException)
    ]
    await asyncio.sleep(15)
    still = sum(not reader.at_eof() and not reader._buffer for reader, _ in opened)
    for _, writer in opened:
        writer.close()
    return f"{still} of 400 still open after 15 s"


async def unread_answers(port: int) -> str:
    """Twelve clients request the largest possible answer, and read nothing for 30 s."""

    async def one(index: int) -> int:
        for period in (1e-4, 5e-4):
            reader, writer = await connect(port)
            writer.transport.pause_reading()  # type: ignore[attr-defined]
            writer.write(post("/optimize", orjson.dumps(sampled(period))))
            await asyncio.sleep(1)
            writer.transport.resume_reading()  # type: ignore[attr-defined]
            status = await asyncio.wait_for(status_of(reader), 60)
            writer.transport.pause_reading()  # type: ignore[attr-defined]
            if status != 422:
                kept.append(writer)
                return status
            writer.close()
        return 422

    kept: list[asyncio.StreamWriter] = []
    statuses = await concurrently(12, one)
    await asyncio.sleep(30)
    for writer in kept:
        writer.transport.abort()
    return counted(statuses)


async def large_bodies(port: int) -> str:
    """300 concurrent bodies of 4 MiB with lists of numbers."""
    body = post("/optimize", numbers(4 << 20))

    async def one(index: int) -> int:
        reader, writer = await connect(port)
        writer.write(body)
        status = await asyncio.wait_for(status_of(reader), 60)
        writer.close()
        return status

    return counted(await concurrently(300, one))


async def many_meshes(port: int) -> str:
    """Four clients request inverse kinematics among 64 mesh files repeatedly for 10 s."""
    bodies = [post("/ik", orjson.dumps(meshes(64, seed))) for seed in range(8)]
    end = time.perf_counter() + 10

    async def one(index: int) -> list[int]:
        statuses: list[int] = []
        while time.perf_counter() < end:
            reader, writer = await connect(port)
            writer.write(bodies[(index + len(statuses)) % len(bodies)])
            statuses.append(await asyncio.wait_for(status_of(reader), 60))
            writer.close()
        return statuses

    return counted([status for statuses in await concurrently(4, one) for status in statuses])


async def long_deadlines(port: int) -> str:
    """40 searches with a deadline of 100 s; the clients disconnect after 25 s."""

    async def one(index: int) -> Streams:
        streams = await connect(port)
        streams[1].write(post("/optimize", orjson.dumps(long_search(100.0))))
        return streams

    opened = [
        streams for streams in await concurrently(40, one) if not isinstance(streams, BaseException)
    ]
    await asyncio.sleep(25)
    refused = [reader for reader, _ in opened if reader._buffer]
    for _, writer in opened:
        writer.close()
    return counted([await status_of(reader) for reader in refused])


async def requests_ahead(port: int) -> str:
    """Eight connections send 20,000 requests each without reading an answer."""

    async def one(index: int) -> float:
        _, writer = await connect(port)
        writer.transport.pause_reading()  # type: ignore[attr-defined]
        with contextlib.suppress(OSError, TimeoutError):
            for _ in range(200):
                writer.write(b"GET /problems HTTP/1.1\r\nHost: localhost\r\n\r\n" * 100)
                await asyncio.wait_for(writer.drain(), 5)
        await asyncio.sleep(3)
        writer.transport.abort()
        return 0.0

    await concurrently(8, one)
    return ""


async def left_uploads(port: int) -> str:
    """200 clients disconnect during an upload to `/evaluate`, and 200 during a body to
    `/optimize`."""

    async def one(index: int) -> None:
        _, writer = await connect(port)
        writer.write(post("/evaluate" if index % 2 else "/optimize", b"[" * 50_000, 1 << 20))
        await writer.drain()
        await asyncio.sleep(1)
        writer.transport.abort()

    await concurrently(400, one)
    await asyncio.sleep(1)
    return ""


ATTACKS: dict[str, Attack] = {
    "headers": endless_headers,
    "half": half_requests,
    "unread": unread_answers,
    "bodies": large_bodies,
    "meshes": many_meshes,
    "deadlines": long_deadlines,
    "ahead": requests_ahead,
    "left": left_uploads,
}


def open_everything(service: Service) -> list[Any]:
    """Three clients: with an incomplete upload, with half a head, and with an unread answer."""
    opened = [Client(service.port, ATTACKER) for _ in range(3)]
    for client, content in zip(
        opened,
        (
            post("/evaluate", b"{", 1 << 20),
            b"GET /he",
            post("/optimize", orjson.dumps(sampled(5e-4))),
        ),
        strict=True,
    ):
        client.send_raw(content)
    time.sleep(4)
    return opened


def time_to_end(service: Service) -> float:
    """Time [s] from SIGTERM to the end of the process."""
    clients = open_everything(service)
    began = time.perf_counter()
    service.process.send_signal(signal.SIGTERM)
    service.process.wait(END_TIMEOUT)
    del clients
    return time.perf_counter() - began


def left_files(service: Service, folder: Path) -> list[str]:
    """Files in the temporary folder after `kill -9` of a service with an incomplete upload."""
    clients = open_everything(service)
    service.process.kill()
    service.process.wait(END_TIMEOUT)
    del clients
    return sorted(path.name for path in folder.iterdir() if path.name.startswith("joulepath-"))


def line(outcome: Outcome) -> str:
    """The outcome as a row of a table."""
    return (
        f"| {outcome.attack} | {outcome.before:.0f} | {outcome.peak:.0f} | {outcome.after:.0f} | "
        f"{outcome.healthz_p99:.0f} | {outcome.healthz_most:.0f} | {outcome.answered} | "
        f"{outcome.refused} | {outcome.honest_most:.1f} | {outcome.seen} |"
    )


def main() -> None:
    """Runs every attack on a new service, or with `--soak` all attacks on one service."""
    arguments = parser(__doc__)
    arguments.add_argument(
        "--only", nargs="+", choices=[*ATTACKS, "end", *CROWDS], help="attacks and crowds (all)"
    )
    arguments.add_argument(
        "--minutes", type=float, default=8.0, help="duration of the mixed crowd [min] (%(default)s)"
    )
    arguments.add_argument(
        "--kill-every", type=float, default=0.0, help="period at which a worker is killed [s]"
    )
    arguments.add_argument(
        "--soak", type=float, default=0.0, help="time of repeated attacks on one service [s]"
    )
    given = arguments.parse_args()
    chosen = given.only or [*ATTACKS, "end", *CROWDS]
    attacks = {name: attack for name, attack in ATTACKS.items() if name in chosen}
    results: dict[str, Any] = {"cores": len(os.sched_getaffinity(0)), "outcomes": [], "crowds": {}}
    print(
        "| attack | before, MiB | peak | after | /healthz p99, ms | most | honest 200 | other | "
        "slowest, s | seen |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")

    def report(name: str, attack: Attack, service: Service) -> None:
        outcome = observed(name, attack, service)
        results["outcomes"].append(asdict(outcome))
        print(line(outcome), flush=True)

    if given.soak:
        with running() as service:
            end = time.perf_counter() + given.soak
            while time.perf_counter() < end:
                for name, attack in attacks.items():
                    report(name, attack, service)
    else:
        for name, attack in attacks.items():
            with running() as service:
                report(name, attack, service)
                service.log.seek(0)
                tracebacks = service.log.read().count(b'"traceback"')
                if tracebacks:
                    print(f"  {tracebacks} tracebacks in the log")
    if "end" in chosen:
        with running() as service:
            results["time_to_end"] = time_to_end(service)
        print(
            "SIGTERM with an open upload, half a head and an unread answer: "
            f"{results['time_to_end']:.1f} s"
        )
        with tempfile.TemporaryDirectory() as folder, running(TMPDIR=folder) as service:
            results["left_files"] = left_files(service, Path(folder))
        print(f"files left by kill -9: {results['left_files'] or 'none'}")
    for name in [crowd for crowd in CROWDS if crowd in chosen and not given.soak]:
        results["crowds"][name] = [
            asdict(phase) for phase in report_crowd(name, given.minutes, given.kill_every)
        ]
    write_json(given.json, results)


if __name__ == "__main__":
    main()
