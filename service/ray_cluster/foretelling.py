"""How much memory a job will need, as far as its row tells, so that no node is given too much.

The library foretells it of a mesh (:func:`simplifier.estimate_memory`); a dispatcher has no mesh,
and goes by sizes.  Where that is too little, the limits of the job's process hold all the same.
"""

from __future__ import annotations

from collections.abc import Sequence

from service.jobs.job import Job, JobFile, JobKind
from service.settings import Settings

_GIB, _MIB = 1 << 30, 1 << 20
_PROCESSES = 400 * _MIB
"""What the Ray worker and the confined process hold before the job begins."""

_LEAST = 160 * _MIB
"""Of a small mesh, beside its process; machine code and pictures for the most part."""

_BY_BYTE = 16
"""Bytes of memory by the byte of a mesh that is not compressed, rounded up: 4 to 10 were foretold
of binary files of half a million triangles and more."""

_BY_VOXEL = 2
"""Bytes by the voxel of a cube of the resolution; few meshes fill one."""

_OF_ONE_MESH = {JobKind.OCCLUDER, JobKind.EVALUATION}
_COMPRESSED = (".3mf", ".zip", ".gz")


def foretold_memory(job: Job, inputs: Sequence[JobFile], settings: Settings) -> int:
    """Bytes of the node that are the job's, its processes among them.

    At most what the job may use; so much also for scenes and sets, whose memory goes by what is in
    the file, and for archives.
    """
    own = job.options.get("memory_limit")
    limit = settings.job_memory if own is None else min(int(own * _GIB), settings.job_memory)
    if job.kind not in _OF_ONE_MESH or any(_is_compressed(one) for one in inputs):
        return _PROCESSES + limit
    size = sum(one.blob.size for one in inputs)
    resolution = job.options.get("resolution") or 64
    return _PROCESSES + min(limit, _LEAST + _BY_BYTE * size + _BY_VOXEL * int(resolution) ** 3)


def _is_compressed(file: JobFile) -> bool:
    return file.name.endswith(_COMPRESSED)
