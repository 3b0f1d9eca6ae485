"""The fingerprint sees values only; text written back means the same protocol."""

from dataclasses import replace
from importlib.resources import files

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.document.dumping import dump_protocol, protocol_to_values
from protocols.document.hashing import hash_protocol
from protocols.document.loading import load_protocol, protocol_from_values

NAMES = tuple(sorted(path.name.removesuffix(".toml") for path in files("protocols").iterdir() if ".toml" in path.name))


@pytest.fixture(params=NAMES)
def shipped(request):
    return load_protocol(files("protocols").joinpath(f"{request.param}.toml").read_text("utf-8"), request.param)


def test_a_protocol_survives_text_and_values(shipped):
    assert load_protocol(dump_protocol(shipped), "again") == shipped
    assert protocol_from_values(protocol_to_values(shipped), "again") == shipped
    assert hash_protocol(load_protocol(dump_protocol(shipped), "again")) == hash_protocol(shipped)


def test_comments_order_and_written_defaults_make_no_difference(threshold, threshold_text):
    lines = [line.split("#")[0] for line in threshold_text.splitlines()]
    without_a_default = "\n".join(line for line in lines if not line.startswith(("fade_in_s", "watchdog_s")))
    head, tail = without_a_default.split("[rests]")
    reordered = head.replace('plane = "yz"', "") + "[rests]" + tail
    assert hash_protocol(load_protocol(reordered, "mine.toml")) == hash_protocol(threshold)


def test_whole_and_real_numbers_hash_alike(threshold, threshold_text):
    text = threshold_text.replace("start_n = 1.0", "start_n = 1").replace("symmetry_deg = 90.0", "symmetry_deg = 90")
    assert hash_protocol(load_protocol(text, "mine.toml")) == hash_protocol(threshold)


def test_equal_protocols_hash_alike_also_with_a_minus_before_zero(threshold):
    plus, minus = (replace(threshold, directions=replace(threshold.directions, symmetry_deg=z)) for z in (0.0, -0.0))
    assert plus == minus
    assert hash_protocol(plus) == hash_protocol(minus)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("start_n = 1.0", "start_n = 1.001"),
        ("[5.0, 15.0, 25.0", "[5.0, 25.0, 15.0"),
        ('"after_reversal"', '"at_reversal"'),
        ('title = "Force', 'title = "The force'),
        ("watchdog_s = 0.5", "watchdog_s = 0.6"),
    ],
)
def test_any_changed_value_changes_the_fingerprint(threshold, threshold_text, old, new):
    assert old in threshold_text
    assert hash_protocol(load_protocol(threshold_text.replace(old, new, 1), "mine.toml")) != hash_protocol(threshold)


def test_the_fingerprint_of_the_published_study_is_known(threshold):
    """Locks and sessions in the field hold it: if this fails, a value or a default was changed, knowingly or not."""
    assert hash_protocol(threshold) == "8bed16e78d40c24d36b274e752a906412fe52398c45e85575f1cc3392ff6c0ee"


def test_the_published_study_of_before_levels_were_roved_keeps_its_fingerprint(threshold_text):
    """New keys count only where they are used: copies of the older file keep their locks and sessions."""
    since = ("rove_db", "repeats_per_run")
    older = "\n".join(line for line in threshold_text.splitlines() if not line.startswith(since))
    known = "acd7b086777d3ab2a13d6d3ac8ca8f763093621a92033bd07c5eb0613ff4478a"
    assert hash_protocol(load_protocol(older, "older.toml")) == known
    fewer = threshold_text.replace("repeats_per_run = 3", "repeats_per_run = 2")
    assert hash_protocol(load_protocol(fewer, "fewer.toml")) != hash_protocol(load_protocol(threshold_text, "t.toml"))


OLD = {
    "direction_training": "454d9291f97b422a36353ed98613827a48a4076c85fa6222e2d6b812574187e8",
    "ellipsoid": "543512b88948b805e8afc06945dae10ffdd03b72064a031e8ee1f2fc004588cc",
    "sweep": "67ca8ad4be7cb4afe553dbf9856be0b424ade33447e93aa22b38e9bd271e287f",
}
"""As they were before recordings knew roles, multisines and lowered amplitudes."""


def text_of(name: str) -> str:
    return files("protocols").joinpath(f"{name}.toml").read_text("utf-8")


@pytest.mark.parametrize("name", OLD)
def test_fields_that_came_later_leave_old_fingerprints_alone(name):
    assert hash_protocol(load_protocol(text_of(name), name)) == OLD[name]


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("rest_s = 1.0", "rest_s = 1.0\nlower_on_clip = true\nleast_amplitude_n = 0.2", True),
        ("rest_s = 1.0", "rest_s = 1.0\nlower_on_clip = false", False),
        ("rest_s = 1.0", "rest_s = 1.0\nleast_amplitude_n = 0.3", False),
        ("[safety]", "[safety]\nfeedback_cap_n = 1.5", True),
        ("[safety]", "[safety]\nfeedback_cap_n = 1.4", False),
        ("[safety]", "[safety.plausibility]\nworkspace_m = 0.12\n[safety]", True),
        ("[safety]", "[safety.plausibility]\nworkspace_m = 0.2\n[safety]", False),
        ('along = "y"', 'along = "y"\nrole = ""', True),
        ('along = "y"', 'along = "y"\nrole = "test"', False),
    ],
)
def test_a_field_that_came_later_counts_only_where_it_changes_something(old, new, same):
    assert old in text_of("sweep")
    changed = hash_protocol(load_protocol(text_of("sweep").replace(old, new), "mine.toml"))
    assert (changed == OLD["sweep"]) is same


@pytest.mark.slow
@given(title=st.text(min_size=1, max_size=40), source=st.text(max_size=40))
@settings(max_examples=80, deadline=None)
def test_any_text_survives_being_written(threshold, title, source):
    protocol = replace(threshold, title=title, source=source)
    assert load_protocol(dump_protocol(protocol), "again") == protocol
