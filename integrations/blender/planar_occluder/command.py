"""An occluder by the ``occluder`` command, as a child process."""

import json
import shutil
import subprocess
import tempfile
from pathlib import Path

from .run import Made, RunError

_NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # Windows alone has one to hide


class CommandRun:
    """Raises RunError where the command cannot be started."""

    share = None

    def __init__(self, command, mesh, options, scratch):
        """``options`` by the command's names; ``scratch`` is a folder for temporary files."""
        program = shutil.which(command)
        if program is None:
            raise RunError(
                f"there is no command '{command}': install planar-occluder, or set the path in the "
                "add-on's preferences"
            )
        self._folder = tempfile.TemporaryDirectory(dir=scratch)
        place = Path(self._folder.name)
        self._made, self._report = place / "occluder.ply", place / "report.json"
        self._errors = place / "errors.txt"
        (place / "mesh.ply").write_bytes(mesh)
        with self._errors.open("wb") as errors:
            self._process = subprocess.Popen(
                [program, "simplify", place / "mesh.ply", "-o", self._made,
                 "--report", self._report, *_arguments(options)],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors,
                creationflags=_NO_WINDOW,
            )  # fmt: skip

    def poll(self):
        status = self._process.poll()
        if status is None:
            return None
        try:
            if status != 0:
                said = self._errors.read_text(errors="replace").strip().splitlines()
                raise RunError(said[-1] if said else f"the command ended with status {status}")
            return Made(self._made.read_bytes(), json.loads(self._report.read_text()))
        finally:
            self._folder.cleanup()

    def cancel(self):
        self._process.kill()
        self._process.wait()
        self._folder.cleanup()


def _arguments(options):
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is True:
            yield flag
        elif value is not False:
            yield from (flag, str(value))
