"""What all tests share: where the real assets are, and how properties are searched.

Properties are tried on the same examples in every run, so that a red run says something about the
change and not about luck.  ``make test`` takes the first two in five of those that a property asks
for, or of fifty, and ``make test-slow`` all of them (``HYPOTHESIS_PROFILE=whole``);
``HYPOTHESIS_PROFILE=search`` looks at new ones each time, and ``mutants`` seeks no smaller example
once one fails.
"""

from __future__ import annotations

import gc
import math
import os
import signal
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from subprocess import CompletedProcess
from typing import TYPE_CHECKING

import certifi
import pytest
from hypothesis import Phase, is_hypothesis_test, settings
from hypothesis.internal.conjecture import providers

from simplifier.kernels.compiled.kernel import Kernel
from simplifier.kernels.threads import thread_count

if TYPE_CHECKING:
    from tests.postgres import PostgresServer
    from tests.s3 import S3Server

# Workers share the processors: threads in each that wait for one another's take a seventh longer.
if workers := int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "0")):
    os.environ.setdefault("OCCLUDER_THREADS", str(max(1, thread_count() // workers)))
    # A command starts no threads for matrices, and no other process that a test starts needs any.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A shell has what it starts in the background ignore Ctrl-C, and so would all that tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# What a kernel says that it takes is what it is given.
Kernel.strict = True

ASSETS = Path(os.environ.get("OCCLUDER_ASSETS", Path(__file__).parents[2] / "shared" / "assets"))

# Hypothesis also draws the constants that it finds in the modules of a process, so that examples
# would change with the tests that ran there before.
assert hasattr(providers, "_get_local_constants")
NO_CONSTANTS = providers._local_constants
providers._get_local_constants = lambda: NO_CONSTANTS

settings.register_profile("steady", derandomize=True, deadline=None, max_examples=50)
settings.register_profile("whole", settings.get_profile("steady"))
settings.register_profile("search", deadline=None)
settings.register_profile(
    "mutants",
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.explicit, Phase.generate],
)
PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "steady")
settings.load_profile(PROFILE)
SHARE = 0.4  # of the examples that a property asks for, which ``steady`` takes


@pytest.fixture(scope="session", autouse=True)
def own_folder(tmp_path_factory: pytest.TempPathFactory) -> None:
    """What commands remember of what they made lies in a folder of the tests."""
    os.environ["XDG_CONFIG_HOME"] = str(tmp_path_factory.mktemp("settings"))


@pytest.fixture(scope="session", autouse=True)
def one_authority(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Each client loads the certificates of all authorities, which takes 40 ms, in whatever process
    it is.  All that tests ask is on loopback, where one authority will do."""
    whole, end = Path(certifi.where()).read_text(), "-----END CERTIFICATE-----\n"
    file = tmp_path_factory.mktemp("authorities") / "one.pem"
    file.write_text(whole[: whole.index(end) + len(end)])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SSL_CERT_FILE", str(file))
        patch.delenv("SSL_CERT_DIR", raising=False)
        yield


@pytest.fixture
def here(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Callable[..., CompletedProcess[str]]:
    """``here("simplify", …)``: the command in this process, where its own is not the subject."""
    from tests.acceptance.command import occluder_here

    return partial(occluder_here, monkeypatch, capfd)


@pytest.fixture(scope="session")
def postgres() -> Iterator[PostgresServer]:
    """A server of this process's own; a skip where PostgreSQL is not installed."""
    from tests.postgres import running_postgres

    with running_postgres() as server:
        yield server


@pytest.fixture(scope="session")
def moto() -> Iterator[S3Server]:
    """An S3 server that keeps its objects in memory."""
    from tests.s3 import running_moto

    with running_moto() as server:
        yield server


@pytest.fixture(scope="session")
def localbucket(tmp_path_factory: pytest.TempPathFactory) -> Iterator[S3Server]:
    """An S3 server that keeps its objects in files."""
    from tests.s3 import running_localbucket

    with running_localbucket(tmp_path_factory.mktemp("localbucket")) as server:
        yield server


@pytest.fixture(scope="session")
def asset() -> Callable[[str], Path]:
    """``asset("bunny_4968.ply")``: the path of a real mesh, or a skip where it is absent."""

    def find(name: str) -> Path:
        path = ASSETS / name
        if not path.exists():
            pytest.skip(f"{name} is not there (set OCCLUDER_ASSETS to the folder of real meshes)")
        return path

    return find


ASKED_FOR = {
    "slow": "takes long, or tries what only developers run; run by `make test-slow`",
    "faults": "a fault of a real server; run by `make test-faults`",
    "cluster": "faults of servers that share a database; run by `make test-cluster`",
    "pages": "one of many looks at a page in a browser; run by `make test-pages`",
}
"""Markers of tests that run only when ``-m`` names them."""


SWEEP = "sweep(every): one case in so many is run by `make test`, all others by `make test-slow`"


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", SWEEP)
    for marker, meaning in ASKED_FOR.items():
        config.addinivalue_line("markers", f"{marker}: {meaning}")


def _take_fewer_examples(items: list[pytest.Item]) -> None:
    asked = "_hypothesis_internal_use_settings"
    functions = {getattr(item.obj, "__func__", item.obj) for item in items
                 if isinstance(item, pytest.Function) and is_hypothesis_test(item.obj)}  # fmt: skip
    for function in functions:
        own = getattr(function, asked, settings.default)
        setattr(function, asked, settings(own, max_examples=math.ceil(SHARE * own.max_examples)))


@pytest.hookimpl(tryfirst=True)  # before pytest picks the items that ``-m`` names
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if PROFILE == "steady":
        _take_fewer_examples(items)
    cases = Counter[str]()
    for item in items:
        if sweep := item.get_closest_marker("sweep"):
            function = item.nodeid.partition("[")[0]
            if cases[function] % sweep.args[0]:
                item.add_marker(pytest.mark.slow)
            cases[function] += 1
    for marker, meaning in ASKED_FOR.items():
        if marker not in config.getoption("markexpr"):
            for item in items:
                if item.get_closest_marker(marker):
                    item.add_marker(pytest.mark.skip(reason=meaning))


def pytest_collection_finish() -> None:
    """Thousands of tests stay to the end: they are not looked through at each collection."""
    gc.collect()
    gc.freeze()
