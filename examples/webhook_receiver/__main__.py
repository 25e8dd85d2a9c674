"""Start the receiver; it ends with Ctrl-C."""

from __future__ import annotations

import argparse
import logging
import os
import shlex
from contextlib import suppress
from pathlib import Path

from examples.webhook_receiver.ledger import Ledger
from examples.webhook_receiver.server import make_server
from examples.webhook_receiver.writing import Writer
from service.client import Client


def main() -> None:
    """The webhooks' secret is OCCLUDER_WEBHOOK_SECRET, a key of the service OCCLUDER_KEY."""
    parser = argparse.ArgumentParser(prog="webhook_receiver", description=__doc__)
    parser.add_argument("--server", required=True, help="the service, as http://127.0.0.1:8000")
    parser.add_argument("--folder", type=Path, required=True, help="where occluders are written")
    parser.add_argument("--ledger", type=Path, default=Path("webhooks.db"), help="what was heard")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8100, help="0 takes a free one")
    parser.add_argument("--then", default="", help="command that is run with the path of each file")
    chosen = parser.parse_args()
    secret = os.environ.get("OCCLUDER_WEBHOOK_SECRET")
    if not secret:
        parser.error("set OCCLUDER_WEBHOOK_SECRET to what 'occluder keys secret' prints")
    if not chosen.folder.is_dir():
        parser.error(f"there is no folder '{chosen.folder}': make it first")
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    logging.getLogger("httpx").setLevel(logging.WARNING)
    # The sender waits ten seconds and then tries again: no use to be more patient.
    with Client(chosen.server, key=os.environ.get("OCCLUDER_KEY"), patience=5.0) as client:
        writer = Writer(client, chosen.folder, Ledger(chosen.ledger), shlex.split(chosen.then))
        with make_server(chosen.host, chosen.port, secret, writer.write) as server:
            print(f"receives at http://{chosen.host}:{server.server_port}", flush=True)
            with suppress(KeyboardInterrupt):
                server.serve_forever()


if __name__ == "__main__":
    main()
