"""Signed addresses: requests that whoever has the address may make for a while.

obstore signs the address of an object, without a query.  So it is told of an endpoint that has one,
which it takes for the beginning of all addresses; what it adds becomes the value of ``x-id``, a
parameter that SDKs send and servers pass over.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from typing import TYPE_CHECKING
from urllib.parse import quote

import obstore
from obstore.store import S3Store

if TYPE_CHECKING:
    from obstore import HTTP_METHOD
    from obstore.store import ClientConfig

_CLIENT: ClientConfig = {"allow_http": True, "timeout": timedelta(seconds=5)}
"""For credentials that have to be asked for."""
_NOTHING = "-"


def signed_address(
    method: HTTP_METHOD, bucket: str, path: str, query: Mapping[str, str], seconds: int
) -> str:
    """Of an object, or of the bucket where the path is empty; for so long.

    Raises obstore's errors.
    """
    lifetime = timedelta(seconds=seconds)
    plain = S3Store(bucket, client_options=_CLIENT)
    address = obstore.sign(plain, method, path or _NOTHING, lifetime).partition("?")[0]
    if not path:
        address = address.removesuffix(f"/{_NOTHING}")
    told = [f"{quote(one, safe='')}={quote(query[one], safe='')}" for one in query]
    endpoint = f"{address}?{'&'.join([*told, 'x-id='])}"
    asking = S3Store(
        bucket, endpoint=endpoint, aws_endpoint_url_s3=endpoint,
        virtual_hosted_style_request=True, client_options=_CLIENT,
    )  # fmt: skip
    return obstore.sign(asking, method, _NOTHING, lifetime)
