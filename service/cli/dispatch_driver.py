"""``python -m service.cli.dispatch_driver DESCRIPTOR``: Ray's driver, as its parent starts it."""

from __future__ import annotations

import typer

from service.cli.command import run_command


def drive(told: int) -> None:
    def run() -> None:
        from service.ray_cluster.driver import run_driver
        from service.settings import read_settings

        run_driver(read_settings({}), told)

    run_command(run, debug=False)


if __name__ == "__main__":
    typer.run(drive)
