"""Broken files and strange meshes, made by the million, against what the library promises.

    make fuzz                                  ten minutes over all targets
    python -m tests.fuzz --seconds 600 ply     one target
    python -m tests.fuzz.replay FILE           a failing input once more, with its traceback

``targets.py`` is the table of what is fuzzed, ``promises/`` what has to hold of each, ``mutation/``
how inputs are changed, ``watched.py`` the process that tries them under a deadline.  ``corpus/``
holds inputs to begin from and ``fixtures/`` what once failed, ``TARGET/NAME`` both; the suite tries
all of them.
"""
