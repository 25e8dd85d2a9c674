"""``python -m simplifier`` is the ``occluder`` command."""

from simplifier.cli.main import main

if __name__ == "__main__":
    main()
