"""Which kernels are compiled: ``python -m tests.acceptance.compilations COMMAND…`` prints them.

Runs the command, given as on the command line, in this process; several commands are parted by a
lone ``+``.  Prints one line for each compilation, then ``done``.
"""

from __future__ import annotations

import sys
from itertools import groupby

from numba.core import event

from simplifier.cli.main import main as occluder


class Compilations(event.Listener):
    """Writes down what numba compiles; machine code that comes from the cache is not compiled."""

    def __init__(self):
        self.found = []

    def on_start(self, event):
        self.found.append(f"{event.data['dispatcher']} {event.data['args']}")

    def on_end(self, event):
        pass


def main():
    listener = Compilations()
    event.register("numba:compile", listener)
    for plus, words in groupby(sys.argv[1:], lambda word: word == "+"):
        if plus:
            continue
        sys.argv = ["occluder", *words]
        try:
            occluder()
        except SystemExit as end:
            if end.code:
                raise
    for line in listener.found:
        print(f"compiled {line}")
    print("done")


if __name__ == "__main__":
    main()
