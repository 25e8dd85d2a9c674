"""The command that keeps the occluders of a manifest current."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from simplifier.builds.build import build_assets as build_assets
from simplifier.builds.finding import Finding
from simplifier.builds.joining import join_shards as join_shards
from simplifier.builds.making import maker_at
from simplifier.builds.manifest import MANIFEST_NAME
from simplifier.builds.record import Record, baseline
from simplifier.builds.reports import json_report, junit_report, markdown_report
from simplifier.builds.shards import Shard, read_shard
from simplifier.builds.staleness import check_assets as check_assets
from simplifier.builds.staleness import files_of_plan
from simplifier.cli.console import count_bar, print_line
from simplifier.cli.findings import print_findings
from simplifier.cli.help import ADVANCED, OUTPUT, QUALITY, with_examples
from simplifier.cli.options import AtOnce, Key, ManifestFile, Server, with_options
from simplifier.cli.running import (
    INTERRUPTED,
    Debug,
    Interrupts,
    Quiet,
    interrupts,
    run_guarded,
)
from simplifier.errors import OptionError
from simplifier.io.files import check_apart, check_folder, write_whole


@with_examples(
    ("occluder build", "Make what is not current of occluders.toml in this folder."),
    ("occluder build --check --against HEAD", "In CI: make nothing, and refuse lost recall."),
    ("occluder build --shard 2/16", "On a farm: make one part of 16; --join after all of them."),
)
@with_options()
def build(
    manifest: ManifestFile = Path(MANIFEST_NAME),
    check: Annotated[
        bool,
        typer.Option(
            "--check",
            help="Make nothing. Fail unless every output is there, current and good enough.",
            rich_help_panel=QUALITY,
        ),
    ] = False,
    against: Annotated[
        str | None,
        typer.Option(
            metavar="RECORD",
            help="A record, or a git revision such as HEAD. Fail where recall has dropped since.",
            rich_help_panel=QUALITY,
        ),
    ] = None,
    junit: Annotated[
        Path | None, typer.Option(help="Write JUnit XML for CI.", rich_help_panel=OUTPUT)
    ] = None,
    markdown: Annotated[
        Path | None, typer.Option(help="Write a summary in Markdown.", rich_help_panel=OUTPUT)
    ] = None,
    json: Annotated[
        Path | None, typer.Option(help="Write all findings as JSON.", rich_help_panel=OUTPUT)
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option(
            metavar="I/N",
            help="Make only the I-th part of N, 1 to N. Any number of parts may run at once, on any"
            " machines.",
            rich_help_panel=ADVANCED,
        ),
    ] = None,
    join: Annotated[
        bool,
        typer.Option(
            "--join",
            help="Make nothing. Merge the records of all parts, and judge all assets.",
            rich_help_panel=ADVANCED,
        ),
    ] = False,
    server: Server = None,
    key: Key = None,
    at_once: AtOnce = None,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Make the occluders of a manifest that are not current, and judge all of them.

    The file occluders.lock beside the manifest records what was made: the content of each mesh, its
    options and the version. The exit status is 1 if an asset fails or misses its requirements.

    Press Ctrl-C to stop and keep what was made. The next run continues from there.
    """

    wanted = {junit: junit_report, markdown: markdown_report, json: json_report}
    reports = {file: report for file, report in wanted.items() if file is not None}
    status = 0

    def run() -> None:
        nonlocal status
        part = None if shard is None else read_shard(shard)
        if join:
            _check_alone(check=check, shard=shard, server=server, at_once=at_once)
        for file in reports:
            check_folder(file)
        if reports:
            check_apart(reports, "the report", files_of_plan(manifest))
        name = manifest.name if part is None else f"{manifest.name} (shard {part})"
        before = {} if against is None else baseline(against, manifest)
        with interrupts() as listening:
            if join:
                findings: Sequence[Finding] = join_shards(manifest, before)
            elif check:
                findings = check_assets(manifest, before, part)
            else:
                findings = _build_findings(manifest, before, part, server, key, at_once, listening)
            with listening.held():
                print_findings(name, findings)
                for file, report in reports.items():
                    write_whole(file, report(name, findings))
        status = int(any(one.faults for one in findings))
        if listening.heard:
            print_line("error: interrupted; what was made is kept, run it again for the rest")
            status = INTERRUPTED

    run_guarded(run, debug=debug, quiet=quiet)
    if status:
        raise typer.Exit(status)


def _build_findings(
    manifest: Path,
    before: Record,
    shard: Shard | None,
    server: str | None,
    key: str | None,
    at_once: int | None,
    listening: Interrupts,
) -> Sequence[Finding]:
    with ExitStack() as stack:
        cancel = stack.enter_context(listening.deferred())
        tell = stack.enter_context(count_bar("occluders"))
        maker = None if server is None else stack.enter_context(maker_at(server, key, cancel))
        return build_assets(
            manifest, cancel, maker=maker, at_once=at_once, before=before, shard=shard, tell=tell
        )


def _check_alone(**others: object) -> None:
    """Raises :class:`OptionError` for what a join would pass over."""
    for name, value in others.items():
        if value not in (None, False):
            raise OptionError(
                f"a join makes nothing, so it cannot be given with --{name.replace('_', '-')}",
                where="join",
                remedy="give --join alone, after all shards",
            )
