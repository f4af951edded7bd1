"""`python -m joulepath.app.cli`: the console command without an installed package."""

from __future__ import annotations

from joulepath.app.cli.main import main

if __name__ == "__main__":
    main()
