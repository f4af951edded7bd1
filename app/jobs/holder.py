"""Names of processes holding leases, from which this machine can tell ended processes."""

from __future__ import annotations

import os
import uuid
from pathlib import Path


def new_holder() -> str:
    """A name for a holder of leases in this process."""
    return f"{_machine()} {os.getpid()} {_start_of(os.getpid())} {uuid.uuid4().hex[:8]}"


def is_gone(holder: str) -> bool:
    """Whether the process of this holder is known to have ended: on this machine, no process with
    its id began when it did. False for a holder on another machine or in another container."""
    *machine, pid, start, _ = holder.split()
    return " ".join(machine) == _machine() and _start_of(int(pid)) != int(start)


def _machine() -> str:
    """The boot of the machine and the namespace of process ids: within both, an id and its start
    are unique.
    """
    boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    return f"{boot} {Path('/proc/self/ns/pid').readlink().name}"


def _start_of(pid: int) -> int | None:
    """Start of a process in ticks since the boot; None if there is none."""
    try:
        state, *fields = (
            Path(f"/proc/{pid}/stat")
            .read_text(encoding="utf-8", errors="replace")
            .rpartition(")")[2]
            .split()
        )
    except OSError:
        return None
    return None if state == "Z" else int(fields[18])
