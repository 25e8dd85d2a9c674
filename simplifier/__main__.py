"""``python -m simplifier`` is the ``occluder`` command."""

from simplifier.cli import main

if __name__ == "__main__":
    main()
