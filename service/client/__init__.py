"""The other end of the wire: a typed client, which needs httpx and nothing else of the service.

    from service.client import Client

    with Client("http://127.0.0.1:8000") as client:
        job = client.wait(client.submit(Path("castle.glb"), options={"budget": 64}).id)
        client.download(job.id, Path("castle_occluder.glb"))
        print(job.summary.precision, job.summary.recall)

Refusals are :class:`~service.client.errors.ClientError`.
"""

from service.client.client import Client
from service.client.errors import ClientError, Problem, StoppedError
from service.client.values import (
    RemoteAsset,
    RemoteFile,
    RemoteJob,
    RemoteLevel,
    RemoteProgress,
    RemoteResult,
)
from service.jobs.job import Priority
from service.keep import Keep

__all__ = [
    "Client",
    "ClientError",
    "Keep",
    "Priority",
    "Problem",
    "RemoteAsset",
    "RemoteFile",
    "RemoteJob",
    "RemoteLevel",
    "RemoteProgress",
    "RemoteResult",
    "StoppedError",
]
