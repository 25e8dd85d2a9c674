"""A store of blobs and a database that belong together, and those that do not."""

from __future__ import annotations

import threading

import pytest

from service.errors import SettingsError
from service.jobs.job import JobFile
from service.storage.blobs.identity import FolderHome, check_identity
from service.storage.job_store import SqlJobStore
from tests.service.storage.blobs.blob_store_contract import blob_of
from tests.service.storage.blobs.s3_stores import memory_bucket
from tests.service.storage.fresh import fresh_database
from tests.service.storage.samples import submission


@pytest.fixture
def folder_home(tmp_path):
    (tmp_path / "blobs").mkdir()
    return FolderHome(tmp_path / "blobs")


@pytest.fixture(params=["bucket", "folder"])
def home(request, folder_home):
    return memory_bucket() if request.param == "bucket" else folder_home


@pytest.fixture(params=["bucket", "folder"])
def other_home(request, tmp_path):
    (tmp_path / "others").mkdir()
    return memory_bucket() if request.param == "bucket" else FolderHome(tmp_path / "others")


@pytest.fixture
def other_database(tmp_path):
    database = fresh_database(tmp_path / "other.db")
    yield database
    database.close()


def name_a_file(database):
    file = JobFile("input/mesh.obj", blob_of(b"mesh"), "model/obj", is_input=True)
    SqlJobStore(database).submit(submission(inputs=(file,)), 1000)


def refusal(database, home, **more):
    before = home.read_identity()
    with pytest.raises(SettingsError) as refused:
        check_identity(database, home, claim=True, **more)
    assert home.read_identity() == before  # nothing is changed
    told = str(refused.value)
    assert "\n" not in told
    assert str(home) in told
    return told


def test_both_are_called_the_same_from_the_first_time_on(database, home):
    name = check_identity(database, home, claim=True)
    assert len(name) == 32
    name_a_file(database)
    assert home.read_identity() == name
    for claim in (True, False):
        assert check_identity(database, home, claim=claim) == name


def test_without_a_claim_nothing_is_written(database, home):
    assert check_identity(database, home, claim=False) is None
    assert home.read_identity() is None


@pytest.mark.parametrize("claim", [True, False])
def test_another_store_is_refused(database, home, other_home, claim):
    """Also an empty one: all that the database names would be lost."""
    check_identity(database, home, claim=True)
    told = refusal(database, other_home)
    assert f"the files of this database are in {home.place}" in told
    assert "set OCCLUDER_BLOBS" in told


def test_a_store_of_another_database_is_refused(database, other_database, home, other_home):
    """Its sweep would take all of it."""
    check_identity(other_database, home, claim=True)
    assert "belong to another database" in refusal(database, home)
    check_identity(database, other_home, claim=True)
    assert f"are in {other_home.place}, and those in '{home}' belong to another" in refusal(
        database, home
    )


def test_files_for_several_hosts_are_refused(database, tmp_path):
    """Each has a folder of its own."""
    hosts = [FolderHome(tmp_path / name) for name in ("host-1", "host-2")]
    for home in hosts:
        home.folder.mkdir()
    check_identity(database, hosts[0], claim=True)
    assert "several need OCCLUDER_BLOBS=s3://BUCKET/PREFIX" in refusal(database, hosts[1])


def test_a_folder_of_a_shared_database_is_refused_to_one_of_its_own(
    database, other_database, folder_home
):
    check_identity(database, folder_home, claim=True)
    with pytest.raises(SettingsError, match="belong to another database"):
        check_identity(other_database, folder_home, claim=False)


def test_new_blobs_for_a_database_that_names_files_are_refused_unless_they_are_brought(
    database, home
):
    name_a_file(database)
    assert "occluder verify --repair --from" in refusal(database, home)
    name = check_identity(database, home, claim=True, may_lack=True)
    assert check_identity(database, home, claim=True) == name


def test_files_may_be_brought_to_another_store_and_the_one_before_is_refused(
    database, home, other_home
):
    before = check_identity(database, home, claim=True)
    name_a_file(database)
    now = check_identity(database, other_home, claim=True, may_lack=True)
    assert now == other_home.read_identity() != before
    assert f"are in {other_home.place}, and those in '{home}'" in refusal(database, home)
    assert check_identity(database, other_home, claim=True) == now


def test_a_claim_that_fails_can_be_made_again(database, home, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(type(home), "write_identity", lambda self, identity: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            check_identity(database, home, claim=True)
    assert check_identity(database, home, claim=True) == home.read_identity()


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_of_two_hosts_that_claim_at_once_one_is_refused(kind, request, tmp_path):
    database = request.getfixturevalue(f"{kind}_database")
    both = threading.Barrier(2)
    told: list[str] = []

    def start(name: str) -> None:
        home = FolderHome(tmp_path / name)
        home.folder.mkdir()
        both.wait()
        try:
            told.append(str(check_identity(database, home, claim=True)))
        except SettingsError as error:
            told.append(str(error))

    threads = [threading.Thread(target=start, args=(f"host-{number}",)) for number in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(map(len, told))[0] == 32
    assert sum("several need" in one for one in told) == 1, told
