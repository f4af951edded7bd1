"""What an operator may set, by environment variable."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from pydantic import AliasChoices, Field
from pydantic_settings import BaseSettings, SettingsConfigDict


def _default_database() -> str:
    """A file where the user's programs keep what they remember (XDG base directory specification)."""
    state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    return f"sqlite:///{state / 'joulepath' / 'joulepath.db'}"


class Settings(BaseSettings):
    """Read from `JOULEPATH_*`, e.g. `JOULEPATH_WORKERS=4`; the port also from `PORT`."""

    model_config = SettingsConfigDict(env_prefix="JOULEPATH_", frozen=True)

    host: str = Field(default="0.0.0.0", description="Address to listen on.")
    port: int = Field(
        default=8000, ge=0, le=65535, validation_alias=AliasChoices("JOULEPATH_PORT", "PORT"), description="TCP port."
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(default="info", description="Least level logged.")
    workers: int = Field(
        default_factory=lambda: len(os.sched_getaffinity(0)),
        ge=1,
        description="Worker processes, each solving one request at a time. Default: the CPUs this process may use.",
    )
    queue_size: int = Field(default=16, ge=0, description="Requests that may wait for a worker; more are refused.")
    max_body_bytes: int = Field(default=4_194_304, ge=1024, description="Largest request body [byte].")
    max_upload_bytes: int = Field(
        default=67_108_864, ge=1024, description="Largest body of `POST /evaluate`, which goes to a file [byte]."
    )
    max_iteration_bytes: int = Field(
        default=1 << 20,
        ge=1024,
        description="Largest body of a study's iteration or of `POST /whatif`, which may hold a motion [byte].",
    )
    max_deadline: float = Field(default=120.0, gt=0, le=600, description="Longest deadline a caller may ask for [s].")
    deadline_grace: float = Field(
        default=5.0, gt=0, description="Time past the deadline after which a worker is killed [s]."
    )
    shutdown_grace: float = Field(
        default=8.0,
        gt=0,
        description="Time that requests in flight have to finish on shutdown [s]; container engines allow 10 s in all.",
    )
    database_url: str = Field(
        default_factory=_default_database,
        description="Where studies and answers are kept: `sqlite:///<file>` or `postgresql://user:password@host/name`. "
        "Default: an SQLite file in `$XDG_STATE_HOME/joulepath`, that is `~/.local/state/joulepath`.",
    )
    answers_max_bytes: int = Field(
        default=1 << 29,
        ge=0,
        description="Most that the answers of no study may take in the database, compressed [byte]; the oldest go.",
    )
    answers_max_age: float = Field(
        default=30.0, gt=0, le=36500, description="Age at which an answer of no study is dropped [days]."
    )
