"""The command group, and the exit codes of commands."""

from __future__ import annotations

import sys

import click

from joulepath import __version__
from joulepath.app.cli.answer import show_problem
from joulepath.app.cli.evaluate import evaluate
from joulepath.app.cli.exit_codes import ANSWERED, INTERRUPTED, INVALID, interruptible
from joulepath.app.cli.export import export
from joulepath.app.cli.identify import identify
from joulepath.app.cli.ik import ik, ik_path
from joulepath.app.cli.jobs import jobs
from joulepath.app.cli.keys import keys
from joulepath.app.cli.rename import rename
from joulepath.app.cli.replay import replay
from joulepath.app.cli.report import check, report
from joulepath.app.cli.robots import robots
from joulepath.app.cli.searches import (
    advice,
    compare,
    cycle,
    excitation,
    optimize,
    pareto,
    placement,
    whatif,
)
from joulepath.app.cli.serve import cluster_worker, ros2, serve
from joulepath.app.cli.studies import studies
from joulepath.app.cli.tools import tools


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="""\b
Exit codes:
    0  the answer is written
    1  the request is valid, and the answer is a problem: no motion, deadline passed, ...
    2  wrong usage or invalid input: invalid-request, invalid-table, unknown-robot, unknown-tool
  130  interrupted by Ctrl-C
  141  the program that reads standard output has ended (SIGPIPE)

\b
Examples:
  joulepath optimize --robot ur10e --from '[0,-90,90,-90,-90,0]deg' --to 'p[.6,-.3,.4,2.22,-2.22,0]'
  joulepath optimize request.json > answer.json

\b
Completion of commands and options, for bash (zsh and fish likewise):
  source <(_JOULEPATH_COMPLETE=bash_source joulepath)""",
)
@click.version_option(__version__, prog_name="joulepath")
def joulepath() -> None:
    """Finds the motion of least energy of a robot arm, with its energy breakdown and a certificate.

    Requests and answers are the same as in the HTTP service. SI units throughout: m, rad, s, kg,
    N·m, W, J. A request that fails writes its problem to standard error: in
    words on a terminal, else as JSON (RFC 9457).
    """


for command in (
    serve,
    optimize,
    pareto,
    compare,
    cycle,
    placement,
    evaluate,
    whatif,
    advice,
    ik,
    ik_path,
    export,
    replay,
    excitation,
    identify,
    jobs,
    studies,
    rename,
    report,
    check,
    robots,
    tools,
    keys,
    ros2,
    cluster_worker,
):
    joulepath.add_command(command)


def main() -> None:
    """Runs the command and exits with its code."""
    try:
        with interruptible():
            code = joulepath.main(prog_name="joulepath", standalone_mode=False) or ANSWERED
    except click.ClickException as error:
        error.show()
        # click would return 1 for an unwritable file
        code = INVALID
    except (click.Abort, KeyboardInterrupt):
        code = INTERRUPTED
    except Exception as error:
        code = show_problem(error)
    sys.exit(code)
