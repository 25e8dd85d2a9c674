"""A mesh that kills whatever process opens it."""

from __future__ import annotations

import pytest

from tests.waiting import until


def test_a_poisonous_mesh_fails_after_its_attempts_and_nothing_else_does(server):
    serving = server(OCCLUDER_WORKERS="2", OCCLUDER_ATTEMPTS="2").start()
    process = serving.process.pid
    poisonous = [serving.submit("# die"), serving.submit("# die\n# again")]
    others = [serving.submit(f"# {number}") for number in range(4)]
    for job_id in poisonous:
        job = serving.end_of(job_id)
        assert (job["state"], job["attempt"], job["attempts"]) == ("failed", 2, 2)
        assert job["failure"]["kind"] == "process-died"
        assert "SIGSEGV" in job["failure"]["detail"]
        assert job["failure"]["remedy"]
    for job_id in others:
        job = serving.end_of(job_id)
        assert (job["state"], job["attempt"]) == ("succeeded", 1)
    until(serving.is_ready)
    assert serving.process.pid == process
    assert serving.process.poll() is None
    assert "Traceback" not in serving.log


@pytest.mark.faults
def test_a_mesh_that_needs_more_memory_than_a_job_may_use_fails_alone(server):
    """By the library: the finest grid of it takes gigabytes."""
    serving = server(work=None, OCCLUDER_WORKERS="2", OCCLUDER_JOB_MEMORY=str(256 << 20)).start()
    greedy = serving.submit(query="&resolution=512&preset=draft")
    modest = serving.submit(query="&resolution=8&moves=0&views=4&image=32&lods=1")
    job = serving.end_of(greedy, 300)
    assert (job["state"], job["failure"]["kind"]) == ("failed", "out-of-memory")
    assert "OCCLUDER_JOB_MEMORY" in job["failure"]["remedy"]
    assert serving.end_of(modest, 300)["state"] == "succeeded"
    print(f"failed in attempt {job['attempt']}: {job['failure']['detail']}")
