"""What a change is compared with: a file, or a revision of git."""

from __future__ import annotations

import pytest

from simplifier.builds.record import baseline, read_record
from simplifier.errors import ManifestError, OptionError
from tests.builds.quick import TRIANGLE, run, write
from tests.git import git


@pytest.fixture
def repository(tmp_path):
    """A commit without a record, and one with; the manifest is in a folder of the repository."""
    (tmp_path / "art").mkdir()
    manifest = write(tmp_path / "art", a=TRIANGLE)
    git(tmp_path, "init", "-q", "-b", "main")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "meshes")
    git(tmp_path, "tag", "meshes")
    run(manifest)
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "occluders")
    return manifest


def test_a_revision_has_the_record_that_was_committed(repository):
    committed = read_record(repository.with_suffix(".lock"))
    (repository.parent / "a.obj").write_bytes(TRIANGLE + b"# 0.1\n")
    run(repository)
    assert baseline("HEAD", repository) == committed
    assert baseline("main", repository) != read_record(repository.with_suffix(".lock"))
    assert baseline("meshes", repository) == {}


def test_a_file_counts_before_a_revision(repository, tmp_path):
    (tmp_path / "old.lock").write_bytes(repository.with_suffix(".lock").read_bytes())
    assert list(baseline(str(tmp_path / "old.lock"), repository)) == ["a.obj"]


@pytest.mark.parametrize("against", ["nowhere", "--output=x", ""])
def test_what_is_neither_is_refused(repository, against):
    with pytest.raises(OptionError, match="neither a file nor a revision"):
        baseline(against, repository)


def test_a_damaged_record_of_a_revision_is_refused(repository):
    repository.with_suffix(".lock").write_text("{}")
    git(repository.parent, "commit", "-q", "-a", "-m", "damage")
    with pytest.raises(ManifestError, match=r"^HEAD:occluders\.lock: this is not a record"):
        baseline("HEAD", repository)
