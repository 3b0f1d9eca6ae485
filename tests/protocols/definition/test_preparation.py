"""The tables of a protocol around its trials: what they refuse, and that they leave old fingerprints alone."""

from dataclasses import replace

import pytest

from protocols.definition.declared_analysis import AnalysisSettings
from protocols.definition.participant_text import TextSettings
from protocols.definition.preparation import MaskingSettings, PracticeSettings
from protocols.definition.probes import ProbeSettings
from protocols.definition.session_settings import CatchSettings, DetectionSettings
from protocols.document.hashing import TABLE_ADDITIONS, hash_protocol
from protocols.document.loading import ProtocolError, load_protocol
from protocols.procedure.practice import (
    PracticeState,
    add_answer,
    count_right_of_last,
    is_practice_over,
    is_practice_passed,
)
from protocols.procedure.run_rules import make_staircase_rule
from protocols.trial import Phase

SETTINGS = PracticeSettings(frequencies_hz=(15.0,), right_needed=3, of_last=4, trial_limit=6)


def after(*answers: bool) -> PracticeState:
    state = PracticeState()
    for answer in answers:
        state = add_answer(state, answer)
    return state


def test_practice_is_passed_by_the_last_answers_alone():
    assert not is_practice_passed(SETTINGS, after(True, True, False, False))
    passed = after(True, False, False, True, True, True)
    assert is_practice_passed(SETTINGS, passed)
    assert count_right_of_last(SETTINGS, passed) == 3
    assert is_practice_over(SETTINGS, after(True, True, True))


def test_practice_ends_without_being_passed():
    never = after(False, True, False, True, False, True)
    assert not is_practice_passed(SETTINGS, never)
    assert is_practice_over(SETTINGS, never)
    assert not is_practice_over(SETTINGS, after(False, True, False, True, False))


@pytest.mark.parametrize(
    ("addition", "complaint"),
    [
        ("[consent]\nstatements = ['I agree.']", "version"),
        ("[practice]\nright_needed = 6\nof_last = 5", "right_needed"),
        ("[practice]\ntrial_limit = 3", "trial_limit"),
        ("[catch]\none_in = 2", "rare"),
        ("[detection]\nfrequencies_hz = [35.0]\ninterval_s = 0.3\n[stimulus]", None),
        ("[gate]\nradius_mm = 80.0", "radius_mm"),
        ("[limits]\ndose_a8_mps2 = 6.0", "dose_a8_mps2"),
    ],
)
def test_what_cannot_be_is_refused_by_name(small_text, addition, complaint):
    with pytest.raises(ProtocolError, match=complaint):
        load_protocol(f"{small_text}\n{addition}\n", "mine.toml")


def test_levels_above_the_cap_are_refused_wherever_they_stand(small_text):
    low = small_text.replace("cap_n = 3.0", "cap_n = 1.5")
    with pytest.raises(ProtocolError, match=r"demo\.level_n"):
        load_protocol(f"{low}\n[demo]\nlevel_n = 2.0\n", "mine.toml")
    with pytest.raises(ProtocolError, match=r"practice\.level_n"):
        load_protocol(f"{low}\n[practice]\nfrequencies_hz = [25.0]\n", "mine.toml")


def test_an_interval_must_hold_more_than_its_fades(small_text):
    slow = small_text.replace("fade_in_s = 0.1", "fade_in_s = 1.5")
    with pytest.raises(ProtocolError, match=r"detection\.interval_s"):
        load_protocol(f"{slow}\n[detection]\nfrequencies_hz = [35.0]\n", "mine.toml")


def test_one_button_cannot_answer_twice(small_text):
    text = small_text.replace("[trial]", "[trial]\ndevice_buttons = [1, 1]")
    with pytest.raises(ProtocolError, match=r"trial\.device_buttons"):
        load_protocol(text, "mine.toml")


def test_the_primary_contrast_is_between_two_frequencies_that_are_played(small_text):
    table = '[analysis]\nprimary = "hierarchical"\ncontrast_hz = {}\n'
    assert load_protocol(f"{small_text}\n{table.format('[]')}", "mine.toml").analysis.primary == "hierarchical"
    with pytest.raises(ProtocolError, match=r"analysis\.contrast_hz"):
        load_protocol(f"{small_text}\n{table.format('[45.0, 1.0]')}", "mine.toml")


def test_absent_tables_leave_an_old_fingerprint_alone(small_protocol):
    """The fingerprint of this very protocol before any of these tables existed."""
    assert hash_protocol(small_protocol) == "3dbd332b83f609b7a013ed32f20036f1da9285a990ec04a93c54899674a16b9a"


@pytest.mark.parametrize("table", sorted(TABLE_ADDITIONS))
def test_a_table_that_is_used_counts(small_protocol, table, threshold):
    kept = replace(small_protocol, measurement=threshold.measurement)
    used = replace(kept, **{table: _other(table, threshold)})
    assert hash_protocol(used) != hash_protocol(kept)


def _other(table, threshold):
    if table == "analysis":
        return AnalysisSettings(primary="hierarchical")
    if table == "detection":
        return DetectionSettings(frequencies_hz=(25.0,))
    if table == "catch":
        return CatchSettings(one_in=20)
    if table == "masking":
        return MaskingSettings(play=True)
    if table == "probes":
        return ProbeSettings(levels_n=(0.5,))
    if table == "text":
        return TextSettings(words={"rest_title": "A break"})
    if table == "before":
        return threshold.debrief
    if table == "limits":
        return replace(threshold.limits, longest_min=60.0)
    return getattr(threshold, table)


def test_detection_follows_the_rule_from_a_level_of_its_own(small_protocol):
    rule = make_staircase_rule(replace(small_protocol, detection=DetectionSettings(start_n=0.25)), Phase.DETECTION)
    assert rule == replace(small_protocol.staircase, start_n=0.25)
    with pytest.raises(ValueError, match="follow no staircase"):
        make_staircase_rule(small_protocol, Phase.CATCH)
