"""`python -m joulepath.app`: the service under uvicorn."""

# Worker processes also import this module: further imports are inside `main`.
from __future__ import annotations

import logging
import os
import signal
import sys
from types import FrameType


def main() -> None:
    """Serves until SIGTERM or Ctrl-C, then exits with 0; with 1 and a message if a setting is
    wrong, or if another program has the address."""
    # for the time before uvicorn handles signals, and after: when it is done, it raises the signal
    # again
    signal.signal(signal.SIGTERM, _exit)
    signal.signal(signal.SIGINT, _exit)

    from joulepath.app.engine.forkserver import remove_sockets, start_forkserver

    start_forkserver()

    from joulepath.app.engine.imports import importing

    with importing():
        from joulepath.app.access.start import check_access
        from joulepath.app.logs import configure_logging
        from joulepath.app.server import serve
        from joulepath.app.settings import WrongSettings, read_settings

    try:
        settings = read_settings()
        check_access(settings)
        configure_logging(settings.log_level)
        serve(settings)
    except WrongSettings as error:
        sys.exit(str(error))
    except SystemExit as ended:
        if ended.code:
            raise
        # The interpreter would take seconds to free all objects one by one.
        logging.shutdown()
        remove_sockets()
        os._exit(0)


def _exit(signum: int, frame: FrameType | None) -> None:
    sys.exit(0)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        sys.exit(
            f"The service takes no arguments, but {sys.argv[1]!r} was given: set JOULEPATH_… in "
            "the environment, or use the commands of `joulepath --help`."
        )
    main()
