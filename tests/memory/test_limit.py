"""Limits of control groups, as containers of both versions show them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from simplifier.memory.limit import cgroup_limits, machine_memory


def groups(folder: Path, membership: str, files: dict[str, str]) -> list[int]:
    """The limits of a process of these groups."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    (folder / "membership").write_text(membership)
    return sorted(cgroup_limits(folder, folder / "membership"))


def test_version_2_counts_the_group_and_those_above(tmp_path):
    files = {"jobs/one/memory.max": "100\n", "jobs/memory.max": "70\n", "memory.max": "max\n"}
    assert groups(tmp_path, "0::/jobs/one\n", files) == [70, 100]


def test_version_1_has_a_hierarchy_of_its_own_for_memory(tmp_path):
    files = {"memory/box/memory.limit_in_bytes": "50\n", "memory.max": "7\n"}
    assert groups(tmp_path, "4:cpu,cpuacct:/box\n3:memory:/box\n", files) == [50]


def test_a_container_whose_path_is_the_hosts_has_its_limit_at_the_root(tmp_path):
    assert groups(tmp_path, "0::/kubepods/pod1\n", {"memory.max": "30\n"}) == [30]


@pytest.mark.parametrize("membership", ["", "0::/\n", "1:name=systemd:/x\n"])
def test_no_group_sets_no_limit(tmp_path, membership):
    assert groups(tmp_path, membership, {}) == []


def test_where_there_are_no_groups_there_is_no_limit(tmp_path):
    assert list(cgroup_limits(tmp_path, tmp_path / "none")) == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="by what Linux tells")
def test_the_machine_has_no_more_than_is_built_in():
    lines = Path("/proc/meminfo").read_text().splitlines()
    assert 0 < machine_memory() <= int(lines[0].split()[1]) * 1024
