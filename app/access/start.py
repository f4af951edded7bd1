"""Checks and log messages about access at the start of the service."""

from __future__ import annotations

import logging

from joulepath.app.access.client import address_of
from joulepath.app.access.key_file import WrongKeyFile
from joulepath.app.access.key_ring import KeyRing
from joulepath.app.settings import Settings, WrongSettings

logger = logging.getLogger(__name__)


def key_ring(settings: Settings) -> KeyRing | None:
    """The API keys; None with open access. Raises WrongSettings."""
    if settings.api_keys_file is None:
        return None
    try:
        return KeyRing(settings.api_keys_file)
    except WrongKeyFile as error:
        raise WrongSettings(f"JOULEPATH_API_KEYS_FILE: {error}") from None


def check_access(settings: Settings) -> None:
    """Raises WrongSettings if other machines could reach a service neither protected nor open."""
    if key_ring(settings) is None and not settings.open and not is_loopback(settings.host):
        raise WrongSettings(
            f"JOULEPATH_HOST={settings.host!r} is reachable from other machines, and there are "
            "no API keys: anyone there could read, change and delete everything.\nEither create "
            "a key with `joulepath keys add NAME --file FILE` and set "
            "JOULEPATH_API_KEYS_FILE=FILE,\nor set JOULEPATH_OPEN=1 if only clients that you "
            "trust can reach this address."
        )


def log_access(settings: Settings) -> None:
    """Logs the kind of access."""
    if settings.api_keys_file is not None:
        logger.info("API keys are required", extra={"file": str(settings.api_keys_file)})
    elif is_loopback(settings.host):
        logger.info("access is open", extra={"to": "every user and program of this machine"})
    else:
        logger.warning(
            "access is open",
            extra={
                "to": f"everyone who reaches {settings.host}, port {settings.port}",
                "remedy": "JOULEPATH_API_KEYS_FILE",
            },
        )


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches an address to listen on."""
    address = address_of(host)
    return host == "localhost" if address is None else address.is_loopback
