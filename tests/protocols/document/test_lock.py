"""A lock knows its protocol by its values."""

import json
from dataclasses import replace

import pytest

from protocols.definition.declared_analysis import AnalysisSettings
from protocols.document.hashing import hash_protocol
from protocols.document.loading import ProtocolError, load_protocol
from protocols.document.lock import LockError, ProtocolLock, check_lock, lock_from_json, lock_to_json, make_lock

WHEN = "2024-05-01T09:00:00+00:00"
LOCAL = "2024-05-01 11:00 +02:00"


@pytest.fixture
def lock(threshold) -> ProtocolLock:
    return make_lock(threshold, WHEN, "0.1.0")


def test_a_lock_fits_its_protocol(lock, threshold):
    check_lock(lock, threshold, LOCAL)
    assert lock == ProtocolLock("direction_threshold", hash_protocol(threshold), WHEN, "0.1.0")


def test_a_changed_protocol_is_refused_with_the_date_and_both_fingerprints(lock, threshold):
    changed = replace(threshold, rests=replace(threshold.rests, after_run_s=61.0))
    with pytest.raises(LockError) as caught:
        check_lock(lock, changed, LOCAL)
    assert str(caught.value) == (
        f"protocol direction_threshold was locked on {LOCAL} and has changed since: "
        f"its fingerprint is {hash_protocol(changed)[:12]}…, the locked one {lock.hash[:12]}…"
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
        (
            {"format": "hapteq-recording"},
            'a lock contains "format": "hapteq-protocol-lock", and this document does not',
        ),
        ({"version": 2}, "the lock is of version 2, and this hapteq reads version 1"),
        ({"hash": None}, "the lock lacks the text hash"),
        ({"name": 3, "locked_utc": None}, "the lock lacks the text name, locked_utc"),
        ({"words": {"rest_title": 1}}, "the lock's words are no texts by key"),
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


OLDER_HASH = "a1e0be03b8f5f359dfac16b3fb28a8e18b27a1505ca4fddab0bc990fecb6ecf7"
DECLARED = {
    "primary": "hierarchical",
    "contrast_hz": (45.0, 5.0),
    "participants": 10,
    "exclusions": ("No participant is left out.",),
    "interval": "paired_t",
}
OTHERS = {
    "contrast_hz": (35.0, 5.0),
    "participants": 11,
    "exclusions": (),
    "interval": "undeclared",
}


@pytest.mark.parametrize("key", list(OTHERS))
def test_contrast_sample_size_exclusions_and_interval_are_locked_each_by_its_own_key(threshold, key):
    declared = replace(threshold, analysis=AnalysisSettings(**DECLARED))
    fixed = make_lock(declared, WHEN, "0.1.0")
    check_lock(fixed, declared, LOCAL)
    changed = replace(threshold, analysis=AnalysisSettings(**{**DECLARED, key: OTHERS[key]}))
    with pytest.raises(LockError, match="has changed since"):
        check_lock(fixed, changed, LOCAL)


def test_a_lock_of_before_intervals_were_declared_by_name_still_fits(threshold_text):
    """Its hash is that of the version before `interval` was a key."""
    text = "\n".join(line for line in threshold_text.splitlines() if not line.startswith("interval ="))
    text = text.replace('primary = "undeclared"', 'primary = "hierarchical"')
    text = text.replace("contrast_hz = []", "contrast_hz = [45.0, 5.0]").replace(
        "participants = 0", "participants = 10"
    )
    older = ProtocolLock("direction_threshold", OLDER_HASH, WHEN, "0.1.0")
    check_lock(older, load_protocol(text, "mine.toml"), LOCAL)


@pytest.mark.parametrize(
    ("primary", "interval", "allowed"),
    [
        ("hierarchical", "tukey", "paired_t, or undeclared"),
        ("published", "paired_t", "tukey, or undeclared"),
        ("undeclared", "tukey", "undeclared, or declare primary, too"),
    ],
)
def test_an_interval_that_the_primary_analysis_does_not_compute_is_refused(threshold_text, primary, interval, allowed):
    text = threshold_text.replace('primary = "undeclared"', f'primary = "{primary}"')
    text = text.replace('interval = "undeclared"', f'interval = "{interval}"')
    with pytest.raises(ProtocolError, match=rf"analysis.interval is {interval}, while primary is {primary}.*{allowed}"):
        load_protocol(text, "mine.toml")
