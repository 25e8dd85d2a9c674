"""The command that has the nodes of a Ray cluster do the jobs of servers."""

from __future__ import annotations

from service.cli.command import run_command
from simplifier.cli.plugin import Debug, print_line


def dispatch(debug: Debug = False) -> None:
    """Offer the jobs of servers that share a database to the nodes of a Ray cluster.

    It runs on a node of the cluster and needs the database (OCCLUDER_DATABASE_URL), Ray's address
    (RAY_ADDRESS) and its token (RAY_AUTH_MODE=token, RAY_AUTH_TOKEN_PATH); the nodes need what
    'occluder work' needs: see docs/operations.md.  Of several, one is active, and another as soon
    as that one is gone.  Exit status: 0 it was told to end; 1 it could not work, and says why; 2 it
    is set up wrongly.

    Ctrl-C (or SIGTERM) gives running jobs back, for others to do, and ends; once more ends it at
    once.
    """

    def run() -> int:
        # Here, not above: 'occluder dispatch --help' need not have a database installed.
        from service.cli.dispatch_host import keep_dispatching
        from service.settings import unknown_settings

        for line in unknown_settings():
            print_line(f"warning: {line}")
        return keep_dispatching()

    run_command(run, debug=debug)
