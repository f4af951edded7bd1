"""`python -m joulepath.app.cli`: the console command where the package is not installed, as in the
container image.
"""

from __future__ import annotations

from joulepath.app.cli.main import main

if __name__ == "__main__":
    main()
