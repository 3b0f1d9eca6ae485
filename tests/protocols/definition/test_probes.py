"""The table of the probes: what it refuses, and that without it nothing is as it was not before."""

import pytest

from protocols.definition.probes import ProbeSettings
from protocols.document.hashing import hash_protocol
from protocols.document.loading import ProtocolError, load_protocol
from study.session.views.form_views import FormKind
from study.session.views.forms import make_form

PROBES = "[probes]\nlevels_n = [0.2, 0.4, 0.8]\nreference_s = 20.0\n"


def text_of(small_text: str, addition: str) -> str:
    """The small protocol, which keeps a whole period of a probe unless the addition says otherwise."""
    kept = small_text.replace("keep_s = 0.2", "keep_s = 1.0")
    if "keep_s = 0.5" in addition:
        kept, addition = small_text, addition.replace("[measurement]\nkeep_s = 0.5\n", "")
    return f"{kept}\n{addition}"


def test_a_table_that_is_not_written_changes_no_fingerprint_and_plays_nothing(small_text, small_protocol):
    assert not small_protocol.probes.is_enabled
    written_out = load_protocol(f"{small_text}\n[probes]\nlevels_n = []\n", "small.toml")
    assert hash_protocol(written_out) == hash_protocol(small_protocol)
    assert hash_protocol(load_protocol(text_of(small_text, PROBES), "small.toml")) != hash_protocol(small_protocol)


@pytest.mark.parametrize(
    ("addition", "complaint"),
    [
        ("[probes]\nlevels_n = [0.5, 1.2]\n", "above probe_cap_n"),
        ("[probes]\nlevels_n = [1.6]\nprobe_cap_n = 1.5\n", "levels_n"),
        ("[probes]\nlevels_n = [0.5]\nprobe_cap_n = 2.0\n", "probe_cap_n"),
        ("[probes]\nlevels_n = [0.5]\ninterval_s = 5.0\n", "interval_s"),
        ("[probes]\nlevels_n = [0.5]\nreference_s = 20.0\nreference_n = 2.0\n", "reference_n"),
        ("[probes]\nreference_s = 20.0\n", "without levels_n"),
        ("[probes]\nlevels_n = [0.5]\nreference_s = 20.0\nto_hz = 30.0\n", "whether the handle is free"),
        ("[measurement]\nkeep_s = 0.5\n[probes]\nlevels_n = [0.5]\n", r"measurement\.keep_s"),
    ],
)
def test_a_protocol_whose_probes_are_too_strong_too_frequent_or_of_no_use_is_refused(small_text, addition, complaint):
    with pytest.raises(ProtocolError, match=complaint):
        load_protocol(text_of(small_text, addition), "mine.toml")


def test_a_probe_stays_below_the_cap_of_the_trials_and_is_no_steeper_than_they_are(small_text):
    low = small_text.replace("cap_n = 3.0", "cap_n = 1.0")
    with pytest.raises(ProtocolError, match=r"probes\.probe_cap_n"):
        load_protocol(text_of(low, "[probes]\nlevels_n = [0.5]\n"), "mine.toml")
    with pytest.raises(ProtocolError, match=r"probes\.to_hz"):
        load_protocol(
            text_of(small_text, "[probes]\nlevels_n = [1.4]\nprobe_cap_n = 1.5\nto_hz = 150.0\n"), "mine.toml"
        )


def test_the_consent_says_what_is_played_between_trials(small_text):
    protocol = load_protocol(text_of(small_text, PROBES), "small.toml")
    form = make_form(protocol, FormKind.CONSENT)
    assert form is not None
    said = form.fields[-1].label
    assert "at most once in 60 seconds" in said
    assert "at most 0.8 newtons" in said
    assert len(form.fields) == len(protocol.consent.statements) + 1


def test_there_is_no_statement_where_nothing_is_played(small_protocol):
    assert make_form(small_protocol, FormKind.CONSENT) is None
    assert ProbeSettings() == small_protocol.probes
