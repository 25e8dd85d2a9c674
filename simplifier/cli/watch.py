"""The command that keeps occluders current while meshes change."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from simplifier.builds.finding import Finding
from simplifier.builds.making import maker_at
from simplifier.builds.manifest import MANIFEST_NAME
from simplifier.builds.watch import watch_assets
from simplifier.cli.console import print_line, print_text
from simplifier.cli.findings import line_of
from simplifier.cli.help import with_examples
from simplifier.cli.options import AtOnce, Key, ManifestFile, Server, with_options
from simplifier.cli.running import Debug, Quiet, interrupts, run_guarded
from simplifier.errors import OccluderError


@with_examples(
    ("occluder watch", "Keep the occluders of occluders.toml in this folder current."),
    ("occluder watch game/occluders.toml --at-once 2", "Make two at a time."),
)
@with_options()
def watch(
    manifest: ManifestFile = Path(MANIFEST_NAME),
    server: Server = None,
    key: Key = None,
    at_once: AtOnce = None,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Build a manifest, and again whenever a mesh or the manifest changes, until Ctrl-C.

    An asset that cannot be built is reported, and tried again when it changes.
    """

    def run() -> None:
        with interrupts() as listening, ExitStack() as stack:
            cancel = stack.enter_context(listening.deferred())
            maker = None if server is None else stack.enter_context(maker_at(server, key, cancel))
            print_text(f"watching the files of {manifest}; press Ctrl-C to stop")
            watch_assets(
                manifest, cancel, found=_tell, refused=_refuse, maker=maker, at_once=at_once
            )

    run_guarded(run, debug=debug, quiet=quiet)


def _tell(finding: Finding) -> None:
    for warning in finding.warnings:
        print_line(f"warning: {finding.asset}: {warning}")
    if finding.faults:
        print_line(f"error: {line_of(finding)}")
    else:
        print_text(line_of(finding))


def _refuse(error: OccluderError) -> None:
    print_line(f"error: {error}")
