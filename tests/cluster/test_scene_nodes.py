"""Scenes and visible sets by two real Ray nodes: the same bytes, whatever is lost meanwhile."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from bench.visibility_city import generated_city
from simplifier.io.scene_writer import write_scene
from tests.acceptance.command import OCCLUDER, environment, occluder
from tests.cluster.machines import NEEDS_RAY
from tests.hierarchy.builds import files
from tests.hierarchy.scenes import scene_of
from tests.solids import box
from tests.test_processes import all_gone
from tests.waiting import BUSY, until

pytestmark = [pytest.mark.cluster, NEEDS_RAY]

QUICK = ("--resolution", "16", "--budget", "8", "--pixel-error", "60", "--ground")
MADE = "occluders are made"
BY_TWO = f"{MADE} on 2 nodes with 2 processors, by ray"


@pytest.fixture(scope="module")
def cluster():
    from tests.cluster.pool_nodes import ray_cluster

    with ray_cluster(nodes=2) as running:
        yield running


def houses(count=84):
    """Boxes of different sizes, which are their own occluders, in groups that have one each."""
    transforms, meshes = [], []
    for place in range(count):
        at = np.eye(4)
        group, one = divmod(place, 7)
        at[:3, 3] = [400.0 * (group % 3) + 12.0 * one, 0.0, 400.0 * (group // 3)]
        transforms.append(at)
        meshes.append(box((10.0 + 0.01 * place, 15.0 + one, 10.0)))
    return scene_of(meshes, range(count), transforms)


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A scene of 181 occluders, and the folder that one process makes of it."""
    folder = tmp_path_factory.mktemp("town")
    write_scene(houses(), folder / "town.glb")
    done = occluder(
        "scene", folder / "town.glb", "-o", folder / "one", *QUICK, OCCLUDER_THREADS="1"
    )
    assert done.returncode == 0, done.stderr
    return folder / "town.glb", files(folder / "one")


def running_scene(cluster, scene, folder):
    """The command, whose lines of progress can be read."""
    return subprocess.Popen(
        [*OCCLUDER, "scene", scene, "-o", folder, *QUICK, "--pool", "ray"],
        env=environment(**cluster.variables), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip


def made(folder):
    return len(list((folder / "occluders").glob("*.glb")))


def test_a_scene_by_two_nodes_has_the_bytes_of_one_process(cluster, town, tmp_path):
    scene, one = town
    with running_scene(cluster, scene, tmp_path / "two") as process:
        _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    assert BY_TWO in errors
    assert files(tmp_path / "two") == one


def test_a_node_that_is_lost_halfway_costs_nothing_but_time(cluster, town, tmp_path):
    scene, one = town
    with running_scene(cluster, scene, tmp_path / "two") as process:
        until(lambda: made(tmp_path / "two") > len(one) // 3, BUSY)
        lost = cluster.nodes.pop()
        begin, before = time.monotonic(), made(tmp_path / "two")
        lost.kill()
        until(lambda: made(tmp_path / "two") > before, BUSY)
        print(f"the next occluder was there {time.monotonic() - begin:.1f} s after a node was lost")
        _, errors = process.communicate(timeout=300)
    cluster.add()
    assert process.returncode == 0, errors
    assert "warning" not in errors
    assert files(tmp_path / "two") == one


def test_what_ray_tells_of_a_lost_node_is_no_part_of_a_commands_answer(cluster, tmp_path):
    """Its answer is on standard output, of JSON where that is asked for."""
    told = tmp_path / "errors"
    join = "from service.ray_cluster.pool import ray_pool\nwith ray_pool(): input()\nprint('{}')"
    with (
        told.open("w") as errors,
        subprocess.Popen(
            [sys.executable, "-c", join], env=environment(**cluster.variables),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True,
        ) as process,
    ):  # fmt: skip
        lost = cluster.nodes.pop()
        until(lambda: lost.named("ray::"), BUSY)  # which the pool has asked what it is
        lost.kill()
        until(lambda: "has been marked dead" in told.read_text(), BUSY)
        answer, _ = process.communicate("\n", timeout=BUSY)
    cluster.add()
    assert answer == "{}\n"


def test_ctrl_c_ends_the_work_on_all_nodes_and_keeps_what_was_made(cluster, town, tmp_path):
    scene, one = town
    with running_scene(cluster, scene, tmp_path / "two") as process:
        until(lambda: made(tmp_path / "two") > 5, BUSY)
        workers = [pid for node in cluster.nodes for pid in node.named("ray::do_job")]
        assert workers
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert all_gone(workers, 10.0)
    print(f"all work had ended {time.monotonic() - begin:.1f} s after Ctrl-C")
    kept = made(tmp_path / "two")
    again = occluder(
        "scene", scene, "-o", tmp_path / "two", *QUICK, "--pool", "ray", **cluster.variables,
        timeout=300,
    )  # fmt: skip
    assert again.returncode == 0, again.stderr
    assert f"{kept:,} were current" in again.stdout
    assert files(tmp_path / "two") == one


def test_a_node_of_another_release_gets_no_work(cluster, town, tmp_path):
    scene, one = town
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "sitecustomize.py").write_text(
        "import simplifier\nsimplifier.__version__ = '0.0.1'\n"
    )
    cluster.nodes.pop().kill()
    path = os.pathsep.join([str(tmp_path / "other"), environment()["PYTHONPATH"]])
    other = cluster.add(PYTHONPATH=path)
    try:
        with running_scene(cluster, scene, tmp_path / "two") as process:
            until(lambda: made(tmp_path / "two") > 5, BUSY)
            assert not other.named("ray::do_job")
            _, errors = process.communicate(timeout=300)
    finally:
        cluster.nodes.pop().kill()
        cluster.add()
    assert process.returncode == 0, errors
    assert f"{MADE} on 1 node with 1 processor, by ray" in errors
    assert "it runs release 0.0.1" in errors
    assert files(tmp_path / "two") == one


def test_a_small_scene_stays_here(cluster, tmp_path):
    write_scene(houses(7), tmp_path / "small.glb")
    done = subprocess.run(
        [*OCCLUDER, "scene", tmp_path / "small.glb", "-o", tmp_path / "out", *QUICK,
         "--pool", "ray"],
        env=environment(**cluster.variables), capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert f"{MADE} on this machine: " in done.stderr
    assert "to make, and others take 64 and more" in done.stderr


def test_visible_sets_by_two_nodes_have_the_bytes_of_one_process(cluster, tmp_path):
    write_scene(generated_city(12), tmp_path / "city.glb")
    asked = ("--up", "z", "--ground", "--cell-size", "8", "--method", "cull-map")
    told = []
    for name, more in (("one", {"OCCLUDER_THREADS": "1"}), ("two", cluster.variables)):
        command = [*OCCLUDER, "pvs", tmp_path / "city.glb", "-o", tmp_path / f"{name}.pvs", *asked]
        command += ["--pool", "ray"] if name == "two" else []
        done = subprocess.run(
            list(map(os.fspath, command)), env=environment(**more), capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        told.append(done.stderr)
    assert "the view cells are computed on 2 nodes with 2 processors, by ray" in told[1]
    assert (tmp_path / "one.pvs").read_bytes() == (tmp_path / "two.pvs").read_bytes()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"RAY_ADDRESS": "127.0.0.2:1"}, "nobody answers at RAY_ADDRESS=127.0.0.2:1"),
        ({"RAY_AUTH_TOKEN": "0" * 64}, "does not take the token of this process"),
        ({"RAY_ADDRESS": "192.0.2.9:6379", "RAY_AUTH_MODE": "disabled"}, "without a token"),
    ],
    ids=["nobody", "wrong token", "no token"],
)
def test_a_cluster_that_cannot_be_joined_is_told_of_in_a_line(
    cluster, town, tmp_path, change, told
):
    done = occluder(
        "scene", town[0], "-o", tmp_path / "two", "--pool", "ray", **cluster.variables | change
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert told in done.stderr
    assert not (tmp_path / "two").exists()
