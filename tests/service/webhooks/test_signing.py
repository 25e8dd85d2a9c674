"""What a receiver can rely on."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.webhooks.signing import SignatureError, sign, verify

SECRET = "whsec_test"
BODY = b'{"event":"job.ended"}'

# printf '%s' '1700000000.{"event":"job.ended"}' | openssl dgst -sha256 -hmac whsec_test
VECTOR = "v1=ed5ad582b953d4294e838681739f0e3ef75027a99b4df79dcdd955d52352f23f"


def headers(signature: str, timestamp: str = "1700000000") -> dict[str, str]:
    return {"Occluder-Timestamp": timestamp, "Occluder-Signature": signature}


def test_the_signature_is_what_other_tools_make_of_it() -> None:
    assert sign(SECRET, 1_700_000_000, BODY) == VECTOR
    verify(SECRET, headers(VECTOR), BODY, now=1_700_000_000)


@given(st.text(min_size=1), st.integers(0, 2**40), st.binary())
def test_what_is_signed_is_verified(secret: str, timestamp: int, body: bytes) -> None:
    signed = headers(sign(secret, timestamp, body), str(timestamp))
    verify(secret, signed, body, now=timestamp)


@given(st.binary(), st.binary())
def test_no_other_body_is_verified(body: bytes, other: bytes) -> None:
    if body != other:
        with pytest.raises(SignatureError):
            verify(SECRET, headers(sign(SECRET, 1_700_000_000, body)), other, now=1_700_000_000)


@pytest.mark.parametrize("signature", ["", "v1=", VECTOR[:-1], VECTOR.upper(), VECTOR[3:], "v1=é"])
def test_other_signatures_are_refused(signature: str) -> None:
    with pytest.raises(SignatureError):
        verify(SECRET, headers(signature), BODY, now=1_700_000_000)


def test_another_secret_is_refused() -> None:
    with pytest.raises(SignatureError, match="secret"):
        verify("whsec_other", headers(VECTOR), BODY, now=1_700_000_000)


def test_the_time_is_signed_too() -> None:
    with pytest.raises(SignatureError):
        verify(SECRET, headers(VECTOR, "1700000001"), BODY, now=1_700_000_000)


@pytest.mark.parametrize(("late", "well"), [(-301, False), (-299, True), (299, True), (301, False)])
def test_a_word_is_good_for_five_minutes(late: int, well: bool) -> None:
    if well:
        verify(SECRET, headers(VECTOR), BODY, now=1_700_000_000 + late)
    else:
        with pytest.raises(SignatureError, match="old"):
            verify(SECRET, headers(VECTOR), BODY, now=1_700_000_000 + late)


@pytest.mark.parametrize("missing", ["Occluder-Timestamp", "Occluder-Signature"])
def test_both_headers_are_needed(missing: str) -> None:
    told = headers(VECTOR)
    del told[missing]
    with pytest.raises(SignatureError, match="missing"):
        verify(SECRET, told, BODY, now=1_700_000_000)


def test_one_of_several_signatures_is_enough() -> None:
    verify(SECRET, headers(f"v2=abc, {VECTOR}"), BODY, now=1_700_000_000)
