"""What groups of processes are allowed: memory, and the time of processors."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from simplifier import control_groups
from simplifier.control_groups import allowed_processors, memory_limits, processor_limits


def groups(folder: Path, membership: str, files: dict[str, str]) -> list[int]:
    """The limits of a process of these groups."""
    return sorted(memory_limits(folder, mounted(folder, membership, files)))


def mounted(folder: Path, membership: str, files: dict[str, str]) -> Path:
    """The file that names the groups of a process."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    (folder / "membership").write_text(membership)
    return folder / "membership"


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
    assert list(memory_limits(tmp_path, tmp_path / "none")) == []


def quotas(folder: Path, membership: str, files: dict[str, str]) -> list[float]:
    return sorted(processor_limits(folder, mounted(folder, membership, files)))


def test_version_2_has_time_and_period_in_one_file(tmp_path):
    files = {
        "pods/one/cpu.max": "150000 100000\n", "pods/cpu.max": "max 100000\n",
        "cpu.max": "800000 200000\n",
    }  # fmt: skip
    assert quotas(tmp_path, "0::/pods/one\n", files) == [1.5, 4.0]


def test_version_1_has_them_in_two_and_less_than_none_is_no_quota(tmp_path):
    files = {
        "cpu/box/cpu.cfs_quota_us": "50000\n", "cpu/box/cpu.cfs_period_us": "100000\n",
        "cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n",
        "cpu.max": "100000 100000\n",
    }  # fmt: skip
    assert quotas(tmp_path, "4:cpu,cpuacct:/box\n3:memory:/box\n", files) == [0.5]


@pytest.mark.parametrize("text", ["", "max\n", "many 100000\n", "100000 0\n", "1 2 3\n"])
def test_what_is_no_quota_is_passed_over(tmp_path, text):
    assert quotas(tmp_path, "0::/\n", {"cpu.max": text}) == []


@pytest.mark.parametrize(
    ("text", "expected"), [("150000 100000", 2), ("20000 100000", 1), ("900000 100000", 3)]
)
def test_a_process_uses_no_more_than_its_quota_nor_more_than_it_may_run_on(
    tmp_path, monkeypatch, text, expected
):
    """A container of two processors on a host of 64 started 64 threads for each kernel."""
    monkeypatch.setattr(control_groups, "ROOT", tmp_path)
    membership = mounted(tmp_path, "0::/\n", {"cpu.max": text})
    monkeypatch.setattr(control_groups, "MEMBERSHIP", membership)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {1, 4, 6}, raising=False)
    control_groups._quotas.cache_clear()
    try:
        assert allowed_processors() == expected
    finally:
        control_groups._quotas.cache_clear()
