"""The commands on webhooks.  They work on the database itself, also while servers run on it.

What programs may want, a secret above all, is alone on standard output.
"""

from __future__ import annotations

from typing import Annotated

import typer

from service.access.key import LOCAL
from service.cli.command import run_command
from service.cli.keys import Data, Tenant, check_known, open_known
from service.cli.moments import moment_words
from service.cli.table import aligned
from service.jobs.deliveries import DeliveryRecord, DeliveryState
from service.journal import COMMAND_LINE, Action
from simplifier.cli.plugin import Debug, print_line, print_text

webhooks = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="List and send again the webhooks of a service, and rotate their secrets.",
)

_HOUR = 3600.0


@webhooks.command("list")
def list_webhooks(
    tenant: Annotated[str | None, typer.Option(help="Only this one's.", show_default="all")] = None,
    state: Annotated[
        DeliveryState | None, typer.Option(help="Only those.", show_default="all")
    ] = None,
    limit: Annotated[int, typer.Option(min=1, max=10_000, help="The newest so many.")] = 50,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Print what became of webhooks, the newest first."""

    def run() -> None:
        from service.jobs.deliveries import DeliveryFilter
        from service.storage.delivery_store import SqlDeliveryStore

        with open_known(data) as opened:
            page = SqlDeliveryStore(opened.database).page(
                tenant, DeliveryFilter(state=state), before=None, limit=limit
            )
        if not page.records:
            print_line("there are no such webhooks")
            return
        cells = [_cells(record) for record in page.records]
        for line in aligned([list(cells[0]), *(list(one.values()) for one in cells)]):
            typer.echo(line)

    run_command(run, debug=debug)


@webhooks.command()
def redeliver(
    webhook: Annotated[str, typer.Argument(metavar="ID", help="Its id, as listed.")],
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Send a webhook again: a server that runs does within a second, others when they start."""

    def run() -> None:
        from service.storage.delivery_store import SqlDeliveryStore

        with open_known(data) as opened:
            record = SqlDeliveryStore(opened.database).redeliver(None, webhook)
        print_line(f"webhook {record.delivery.id} of job {record.delivery.job_id} is due now")

    run_command(run, debug=debug)


@webhooks.command("rotate-secret")
def rotate_secret(
    tenant: Tenant = LOCAL.tenant,
    overlap_hours: Annotated[
        float,
        typer.Option(
            min=0.0, max=24.0 * 365.0,
            help="For how long the old secret is good as well; 0 where it has leaked.",
        ),
    ] = 24.0,
    data: Data = None,
    debug: Debug = False,
) -> None:  # fmt: skip
    """Sign a tenant's webhooks with a new secret, and print it; for a while with both."""

    def run() -> None:
        from service.storage.journal_store import SqlJournal
        from service.storage.secret_ages import SqlSecretAges

        with open_known(data) as opened:
            check_known(tenant, opened.keys)
            age = SqlSecretAges(opened.database).rotate(tenant, overlap_hours * _HOUR)
            action = Action.WEBHOOK_SECRET_ROTATED
            SqlJournal(opened.database).note(tenant, COMMAND_LINE, action, tenant)
            print_text(opened.webhook_secret(tenant, age.generation))
        ends = moment_words(age.overlap_ends)
        until = f"is good until {ends}" if overlap_hours else "is good no more"
        print_line(f"webhooks of {tenant} are signed with it from now on; the one before {until}")

    run_command(run, debug=debug)


def _cells(record: DeliveryRecord) -> dict[str, str]:
    """A row of the list; of the address the host, as its path may be the receiver's secret."""
    from service.schemas.job import origin

    last = record.attempts[-1] if record.attempts else None
    return {
        "id": record.delivery.id,
        "tenant": record.delivery.tenant,
        "state": record.state,
        "tries": str(len(record.attempts)),
        "last": moment_words(last.at if last else None),
        "ms": f"{last.milliseconds:.0f}" if last else "-",
        "status": str(last.status) if last and last.status else "-",
        "to": origin(record.delivery.url),
        "why": (last.reason or "-") if last else "-",
    }
