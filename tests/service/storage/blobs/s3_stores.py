"""A store in a bucket, put together as the service does it, and what is left in the bucket."""

from __future__ import annotations

import secrets
from pathlib import Path

from obstore.store import MemoryStore, ObjectStore

from service.storage.blobs.bucket import Address, Bucket
from service.storage.blobs.cache import BlobCache
from service.storage.blobs.identity import check_identity
from service.storage.blobs.ledger import BlobLedger
from service.storage.blobs.s3_blobs import BucketParts, S3Blobs
from service.storage.database import Database

MIB = 1 << 20


def memory_bucket(store: ObjectStore | None = None) -> Bucket:
    """In this process, which is quick."""
    store = store or MemoryStore()
    return Bucket(Address("memory", ""), store, store, store)


def store_in(bucket: Bucket, database: Database, folder: Path, **more) -> S3Blobs:
    """One of several instances that share bucket and database."""
    identity = check_identity(database, bucket, claim=True)
    cache = BlobCache(folder / f"cache-{secrets.token_hex(4)}", 64 * MIB)
    return S3Blobs(BucketParts.of(bucket, BlobLedger(database, **more), identity), cache)


def keys_in(bucket: Bucket) -> set[str]:
    """Of all objects but the identity."""
    return set(bucket.keys())
