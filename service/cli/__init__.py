"""The commands that the service adds to ``occluder``.

:mod:`service.cli.commands` lists them; each imports what it needs when it runs, so
``occluder --help`` does not pay for a server.
"""
