"""A lock knows its protocol by its values."""

import json
from dataclasses import replace

import pytest

from protocols.document.hashing import protocol_hash
from protocols.document.lock import LockError, ProtocolLock, check_lock, lock_from_json, lock_of, lock_to_json

WHEN = "2024-05-01T09:00:00+00:00"
LOCAL = "2024-05-01 11:00 +02:00"


@pytest.fixture
def lock(threshold) -> ProtocolLock:
    return lock_of(threshold, WHEN, "0.1.0")


def test_a_lock_fits_its_protocol(lock, threshold):
    check_lock(lock, threshold, LOCAL)
    assert lock == ProtocolLock("direction_threshold", protocol_hash(threshold), WHEN, "0.1.0")


def test_a_changed_protocol_is_refused_with_the_date_and_both_fingerprints(lock, threshold):
    changed = replace(threshold, rests=replace(threshold.rests, after_run_s=61.0))
    with pytest.raises(LockError) as caught:
        check_lock(lock, changed, LOCAL)
    assert str(caught.value) == (
        f"protocol direction_threshold was locked on {LOCAL} and has changed since: "
        f"its fingerprint is {protocol_hash(changed)[:12]}…, the locked one {lock.hash[:12]}…"
    )


def test_a_lock_of_another_protocol_is_refused(lock, threshold):
    with pytest.raises(LockError, match="the lock is that of protocol direction_threshold, not of mine"):
        check_lock(lock, replace(threshold, name="mine"), LOCAL)


def test_a_lock_survives_its_file_and_says_what_it_is(lock):
    text = lock_to_json(lock)
    assert lock_from_json(text) == lock
    document = json.loads(text)
    assert (document["format"], document["version"]) == ("hapteq-protocol-lock", 1)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"format": "hapteq-recording"}, 'a lock says "format": "hapteq-protocol-lock", and this document does not'),
        ({"version": 2}, "the lock is of version 2, and this hapteq knows version 1"),
        ({"hash": None}, "the lock lacks the text hash"),
        ({"name": 3, "locked_utc": None}, "the lock lacks the text name, locked_utc"),
    ],
)
def test_a_wrong_document_is_told_why(lock, change, problem):
    with pytest.raises(LockError) as caught:
        lock_from_json(json.dumps({**json.loads(lock_to_json(lock)), **change}))
    assert str(caught.value) == problem


@pytest.mark.parametrize("text", ["", "{", "not json"])
def test_a_torn_document_is_told_so(text):
    with pytest.raises(LockError, match="a lock is a JSON document, but this is none"):
        lock_from_json(text)


def test_a_list_is_no_lock():
    with pytest.raises(LockError, match="and this document does not"):
        lock_from_json("[]")
