from __future__ import annotations

import pytest

from tests.service.routes.serving import served


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    with served(tmp_path_factory.mktemp("data"), max_wait=5.0) as one:
        yield one
