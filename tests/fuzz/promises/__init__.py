"""What has to hold whatever goes in, a file each for what comes out."""

from __future__ import annotations

from simplifier.errors import OccluderError


class BrokenPromiseError(AssertionError):
    """The library returned, and what it returned is not what it promises."""


def promise(kept: object, what: str) -> None:
    """Raise where something does not hold; ``what`` says what should."""
    if not kept:
        raise BrokenPromiseError(what)


def check_refusal(error: OccluderError) -> None:
    """A refusal is one line that says something."""
    text = str(error)
    promise(error.what.strip(), "a refusal says what is wrong")
    promise(text.isprintable(), f"a refusal is one printable line: {text!r}")
    promise(len(text) < 1000, "a refusal fits a screen")


def check_sentence(text: str) -> None:
    """A warning is one line of words, and all its numbers are some."""
    words = text.replace(",", " ").replace(";", " ").split()
    promise(text.isprintable() and len(words) > 2, f"a warning is a sentence: {text!r}")
    promise(not {"nan", "inf", "-inf", "None"} & set(words), f"a warning knows all: {text!r}")
