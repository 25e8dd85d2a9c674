"""``ray start`` for nodes that this machine alone can reach.

Ray listens on loopback only where its node has the address 127.0.0.1, which it takes for a slip and
replaces by one that others reach.  ``TESTS_RAY_VERSION`` and ``TESTS_PYTHON_VERSION`` are told as
those of the cluster.
"""

from __future__ import annotations

import os

import ray
import ray._private.services as services
import ray._private.utils as utils

services.resolve_ip_for_localhost = lambda host: host
services.find_gcs_addresses = set  # else processes of a node tell a head here that it runs already
if version := os.environ.pop("TESTS_RAY_VERSION", None):
    ray.__version__ = version
if python := os.environ.pop("TESTS_PYTHON_VERSION", None):
    utils.compute_version_info = lambda: (ray.__version__, python)

if __name__ == "__main__":
    from ray.scripts.scripts import main

    main()
