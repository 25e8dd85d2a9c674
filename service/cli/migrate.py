"""The command that brings a database to the schema of this release."""

from __future__ import annotations

from service.cli.command import run_command
from service.cli.keys import Data
from simplifier.cli.plugin import Debug, print_line


def migrate(data: Data = None, debug: Debug = False) -> None:
    """Bring the database to this release, whose workers get the work from then on.

    Run it once before the servers of a new release start: those of the release before go on beside
    it until they are stopped, but get no more work. A server with a database of its own does this
    by itself when it starts. The exit status is 0 also where there was nothing to do.
    """

    def run() -> None:
        # Here, not above: 'occluder migrate --help' need not have a database installed.
        from service.cli.keys import settings_of
        from service.storage.opening import migrate_database
        from service.webhooks.tenant_secrets import TenantSecrets

        settings = settings_of(data)
        secret = None
        if settings.secret_file is not None:
            secret = TenantSecrets.named_by(settings).fingerprint
        print_line(migrate_database(settings, secret))

    run_command(run, debug=debug)
