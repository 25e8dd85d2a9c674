"""What goes wrong with a bucket, in words, from what obstore tells of it.

That is a line, the server's answer, and all causes below; there is no other way to tell one
failure from another.
"""

from __future__ import annotations

import os
import re

_FULL = ("QuotaExceeded", "XMinioStorageFull", "XMinioAdminBucketQuotaExceeded")
_OTHER_REGION = (
    "PermanentRedirect", "AuthorizationHeaderMalformed", "IllegalLocationConstraintException",
)  # fmt: skip
_BAD_CREDENTIALS = (
    "InvalidAccessKeyId", "SignatureDoesNotMatch", "ExpiredToken", "InvalidToken",
    "TokenRefreshRequired", "RequestTimeTooSkewed",
)  # fmt: skip
_METADATA = "http://169.254.1"
"""What obstore asks for credentials where no variable tells of any."""
_RIGHTS = (
    "s3:ListBucket, s3:GetObject, s3:PutObject, s3:DeleteObject, s3:ListBucketMultipartUploads and "
    "s3:AbortMultipartUpload"
)
_IN_WORDS = (
    ("ConnectionRefused", "the connection is refused"),
    ("failed to lookup address", "its name is not known"),
    ("dns error", "its name is not known"),
    ("CertificateError", "its certificate is not trusted"),
    ("invalid peer certificate", "its certificate is not trusted"),
    ("InvalidContentType", "it does not speak TLS"),
    ("TimedOut", "no answer in time"),
    ("Timeout", "no answer in time"),
    ("error sending request", "no connection"),
)


def settings_fault(address: str, told: str) -> str:
    """What is wrong with the settings, and what to do, in a line."""
    code, region = code_of(told), os.environ.get("AWS_REGION", "us-east-1")
    if code == "NoSuchBucket":
        what, remedy = "is in no bucket that there is", "make the bucket, or correct the name"
    elif code in _OTHER_REGION or "redirect" in told:
        found = re.search(r"<Region>([\w-]+)</Region>|expecting '([\w-]+)'", told)
        there = next(filter(None, found.groups()), "") if found else ""
        what = f"is in another region than '{region}'"
        remedy = f"set AWS_REGION={there or 'REGION'}"
    elif _METADATA in told:
        what = "has to be asked with credentials, and there are none"
        remedy = "set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or give this machine a role"
    elif code in _BAD_CREDENTIALS or status_of(told) == 401:
        what = f"refuses the credentials ({code or 401})"
        remedy = "check AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN"
    elif status_of(told) == 403:
        what, remedy = f"denies what is asked of it ({code or 403})", f"allow {_RIGHTS} on it"
    else:
        what = f"cannot be reached ({in_words(told)})"
        remedy = "check AWS_ENDPOINT_URL and AWS_REGION, and that the server runs"
    return f"OCCLUDER_BLOBS={address} {what}; {remedy}"


def in_words(told: str) -> str:
    """The reason among what obstore tells, which begins with a line and goes on with all causes."""
    status, code = status_of(told), code_of(told)
    if status is not None:
        return f"it answers {status} {code}".rstrip()
    return next((words for part, words in _IN_WORDS if part in told), "no answer")


def status_of(told: str) -> int | None:
    found = re.search(r"status code: (\d{3})", told)
    return int(found[1]) if found else None


def code_of(told: str) -> str:
    """The code of S3's answer, empty where there is none."""
    found = re.search(r"<Code>(\w+)</Code>", told)
    return found[1] if found else ""


def is_full(told: str) -> bool:
    """Whether there is no room."""
    return code_of(told) in _FULL or status_of(told) == 507


def is_beyond(told: str) -> bool:
    """Whether the object ends before the range that was asked for begins."""
    return status_of(told) == 416 or "Invalid range" in told
