"""Every way in which a protocol file can be wrong is told with file, key and what is allowed."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.definition.staircase_rule import StepChange
from protocols.document.loading import ProtocolError, load_protocol, protocol_from_values

RECORDING = """
name = "small"
kind = "recording"
title = "One sine"
[safety]
stimulus_cap_n = 2.0
total_cap_n = 3.0
[[segments]]
kind = "sine"
frequencies_hz = [5.0]
amplitude_n = 1.0
along = "x"
duration_s = 1.0
[[segments]]
kind = "sweep"
from_hz = 1.0
to_hz = 100.0
amplitude_n = 1.0
along = "x"
duration_s = 1.0
"""


def refused(text: str) -> ProtocolError:
    with pytest.raises(ProtocolError) as caught:
        load_protocol(text, "mine.toml")
    return caught.value


def changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


ONE_CHANGE = [
    # wrong key, wrong unit
    ("start_n = 1.0", "start_mN = 1000.0", "staircase.start_mN", "is no key of [staircase]; did you mean start_n"),
    ("start_n = 1.0", "start_db = 0.0", "staircase.start_db", "is no key of [staircase]; did you mean start_n"),
    ("fade_in_s = 0.5", "fade_in_ms = 500", "stimulus.fade_in_ms", "is no key of [stimulus]; did you mean fade_in_s"),
    ("plane = ", "plain = ", "directions.plain", "is no key of [directions]; did you mean plane"),
    ("plane = ", "zzz = ", "directions.zzz", "is no key of [directions]"),
    ("plane = ", "watchdog_s = 1\nplane = ", "directions.watchdog_s", "; it belongs in [safety]"),
    ("plane = ", "title = 'x'\nplane = ", "directions.title", "it belongs at the top of the file, before the first"),
    ('kind = "study"', 'kind = "study"\nstimuli = 1', "stimuli", "is no key of a protocol; did you mean stimulus"),
    ("step_db = 4.0", "step_n = 4.0", "staircase.steps[1].step_n", "is no key of [staircase.steps[1]]; did you mean"),
    # missing
    ("start_n = 1.0", "", "staircase.start_n", "is missing"),
    ("stimulus_cap_n = 3.0", "", "safety.stimulus_cap_n", "is missing"),
    # bounds
    ("cap_n = 3.0", "cap_n = 3.5", "staircase.cap_n", "is 3.5, which is too large"),
    ("start_n = 1.0", "start_n = 0", "staircase.start_n", "is 0, which is too small"),
    ("fade_in_s = 0.5", "fade_in_s = 0.0", "stimulus.fade_in_s", "is 0.0, which is too small"),
    ("step_db = 1.0", "step_db = 30", "staircase.steps[2].step_db", "is 30, which is too large"),
    ("[5.0, 15.0", "[5.0, 1500.0", "stimulus.frequencies_hz[2]", "is 1500.0, which is too large"),
    ("start_n = 1.0", "start_n = nan", "staircase.start_n", "is nan, not a finite number"),
    ("start_n = 1.0", "start_n = -inf", "staircase.start_n", "is -inf, not a finite number"),
    # types
    ("start_n = 1.0", "start_n = true", "staircase.start_n", "is true, a truth value"),
    ("start_n = 1.0", 'start_n = "1.0"', "staircase.start_n", 'is "1.0", a text'),
    ("down_after_right = 3", "down_after_right = true", "staircase.down_after_right", "is true, a truth value"),
    ("down_after_right = 3", "down_after_right = 3.0", "staircase.down_after_right", "is 3.0"),
    ("initial_one_up_one_down = false", "initial_one_up_one_down = 0", "staircase.initial_one_up_one_down", "is 0"),
    ("[5.0, 15.0, 25.0, 35.0, 45.0]", "5.0", "stimulus.frequencies_hz", "is 5.0"),
    ('plane = "yz"', 'plane = ["yz"]', "directions.plane", "is a list"),
    ("[directions]", "[directions]\n[directions.plane]", "directions.plane", "is a table"),
    ('plane = "yz"', "plane = 2020-01-01", "directions.plane", "is 2020-01-01, a date or time"),
    # choices and texts
    ('plane = "yz"', 'plane = "zy"', "directions.plane", 'is "zy"'),
    ('"after_reversal"', '"after_reversals"', "staircase.step_change", 'is "after_reversals"'),
    ('name = "direction_threshold"', 'name = "My study"', "name", 'is "My study"'),
    ('title = "Force', 'title = ""  # "', "title", "has 0 characters"),
    ('kind = "study"', 'kind = "studies"', "kind", 'is "studies"'),
    ('kind = "study"', "kind = 1", "kind", "is 1"),
    ('kind = "study"', "", "kind", "is missing"),
    # values that do not go together
    ("cap_n = 3.0", "cap_n = 0.5", "staircase.start_n", "is 1.0 N, above cap_n"),
    ("averaged_reversals = 10", "averaged_reversals = 14", "staircase.averaged_reversals", "more than a run has"),
    ("reversals = 13 ", "reversals = 12 ", "staircase.steps", "plan 13 reversals in all, but the run ends after 12"),
    ("total_cap_n = 4.5", "total_cap_n = 2.5", "safety.total_cap_n", "is 2.5 N, below stimulus_cap_n"),
    ("stimulus_cap_n = 3.0", "stimulus_cap_n = 2.0", "safety.stimulus_cap_n", "the highest levels could not be played"),
    ("time_limit_s = 0.0", "time_limit_s = 120", "trial.time_limit_s", "not below safety.longest_trial_s"),
    ("keep_s = 1.0", "keep_s = 0.1", "measurement.keep_s", "less than one period of the lowest frequency"),
    ("[5.0, 15.0", "[5.0, 5.0", "stimulus.frequencies_hz", "names a frequency twice"),
    ("[5.0, 15.0", "[5.0, 15.05", "stimulus.frequencies_hz[2]", "is 15.05 Hz"),
]


@pytest.mark.parametrize(("old", "new", "key", "problem"), ONE_CHANGE)
def test_one_wrong_thing_is_one_problem_with_its_key(threshold_text, old, new, key, problem):
    error = refused(changed(threshold_text, old, new))
    assert len(error.problems) == 1
    assert error.source == "mine.toml"
    assert error.key == key
    assert problem in error.problem
    assert str(error) == f"mine.toml: {key} {error.problem}. Allowed: {error.allowed}."


@pytest.mark.parametrize("new", ["start_n = 3.0", "start_n = 1", "start_n = 0.001"])
def test_possible_values_are_taken(threshold_text, new):
    assert load_protocol(changed(threshold_text, "start_n = 1.0", new), "mine.toml").kind == "study"


ALLOWED = [
    ("cap_n = 3.0", "cap_n = 9", "a number above 0 up to 3, in newtons"),
    ("down_after_right = 3", "down_after_right = 0", "a whole number from 1 up to 10"),
    ("step_db = 4.0", "step_db = 0", "a number above 0 up to 20, in decibels"),
    ("symmetry_deg = 90.0", "symmetry_deg = 720", "a number from -180 up to 180, in degrees"),
    ("initial_one_up_one_down = false", "initial_one_up_one_down = 0", "true or false"),
    ('plane = "yz"', 'plane = "zy"', '"xy", "yz" or "zx"'),
    ('"after_reversal"', '"later"', '"after_reversal", "at_reversal" or "at_next_reversal"'),
    ('kind = "study"', 'kind = "x"', '"study" or "recording"'),
    ("[5.0, 15.0, 25.0, 35.0, 45.0]", "5", "a list of 0 to 20 entries, each a number from 0.5 up to 250, in hertz"),
    ('title = "Force', 'title = ""  # "', "text in quotes, 1 to 200 characters long"),
    ('name = "direction_threshold"', 'name = ""', "text in quotes: a lower-case letter, then up to 63 lower-case"),
    ('key = "strategy"', f'key = "{"a" * 41}"', "text in quotes: a lower-case letter, then up to 39 lower-case"),
    ("plane = ", "zzz = ", "plane, symmetry_deg"),
    ("[5.0, 15.0", "[5.0, 15.05", "whole tenths of a hertz, so that whole periods can be looped"),
    ("cap_n = 3.0", "cap_n = 0.5", "at most 0.5 N, the cap"),
    ("averaged_reversals = 10", "averaged_reversals = 14", "at most 13, the number in reversals"),
    ("reversals = 13 ", "reversals = 12 ", "phases whose reversals add up to the number in reversals"),
    ("total_cap_n = 4.5", "total_cap_n = 2.5", "at least 3.0 N, the stimulus_cap_n, with room for the spring"),
    ("stimulus_cap_n = 3.0", "stimulus_cap_n = 2.0", "at least 3.0 N, the staircase's cap"),
    ("time_limit_s = 0.0", "time_limit_s = 120", "below 120.0 s, or 0 for none"),
    ("keep_s = 1.0", "keep_s = 0.1", "at least 0.2 s"),
]


@pytest.mark.parametrize(("old", "new", "allowed"), ALLOWED)
def test_what_is_allowed_is_reported(threshold_text, old, new, allowed):
    assert allowed in refused(changed(threshold_text, old, new)).allowed


def test_a_value_where_a_table_belongs_is_refused(threshold_text):
    error = refused("directions = 3\n" + changed(threshold_text, "[directions]", "[spare]"))
    directions = next(problem for problem in error.problems if problem.key == "directions")
    assert (directions.problem, directions.allowed) == ("is 3", "a table with the keys plane, symmetry_deg")


def test_a_study_without_any_frequency_is_refused(threshold_text):
    text = changed(threshold_text, "[5.0, 15.0, 25.0, 35.0, 45.0]", "[]")
    text = changed(text, "[15.0, 25.0, 35.0, 45.0]", "[]")
    error = refused(changed(text, "frequencies_hz = [5.0]", "frequencies_hz = []"))
    assert error.key == "stimulus.frequencies_hz"
    assert error.problem == "is empty, and so are training, practice and detection: nothing would be played"
    assert error.allowed == "at least one frequency in one of them"


def test_a_list_that_may_not_be_empty_says_so(threshold_text):
    spare = threshold_text.replace("[[staircase.steps]]", "[[spare]]")
    error = refused(changed(spare, "start_n", "steps = []\nstart_n"))
    steps = next(problem for problem in error.problems if problem.key == "staircase.steps")
    assert steps.problem == "has 0 entries"
    assert "a list of 1 or more entries, each a table with the keys step_db, reversals" in steps.allowed


def test_a_list_that_is_too_long_says_so(threshold_text):
    many = ", ".join(str(frequency) for frequency in range(1, 30))
    error = refused(changed(threshold_text, "5.0, 15.0, 25.0, 35.0, 45.0", many))
    assert (error.key, error.problem) == ("stimulus.frequencies_hz", "has 29 entries")


def test_all_problems_are_listed_and_numbered(threshold_text):
    text = changed(threshold_text, "cap_n = 3.0", "cap_n = 5")
    text = changed(text, "step_db = 1.0", 'step_db = "1"')
    error = refused(changed(text, "fade_shape", "fade_shapes"))
    assert str(error).splitlines() == [
        "mine.toml has 3 problems:",
        "  1. stimulus.fade_shapes is no key of [stimulus]; did you mean fade_shape. "
        "Allowed: frequencies_hz, quantity, fade_in_s, fade_out_s, fade_shape, onset_polarity, rove_db.",
        "  2. staircase.cap_n is 5, which is too large. Allowed: a number above 0 up to 3, in newtons.",
        '  3. staircase.steps[2].step_db is "1", a text. Allowed: a number above 0 up to 20, in decibels.',
    ]


BROKEN = {"kind study\n": "line 2", "kind = ": "(at line 2, the end of the text)", "name = 'y'\n": "(at line 2"}


@pytest.mark.parametrize("second_line", BROKEN)
def test_broken_toml_is_reported_with_its_line(second_line):
    error = refused(f"name = 'x'\n{second_line}")
    assert "is not TOML" in error.problem
    assert BROKEN[second_line] in error.problem


RECORDINGS = [
    ('kind = "sine"', 'kind = "sin"', "segments[1].kind", 'is "sin"; did you mean "sine"'),
    ('kind = "sine"', 'kind = "noise"', "segments[1].kind", 'is "noise"'),
    ('kind = "sine"', "", "segments[1].kind", "is missing"),
    ("frequencies_hz = [5.0]", "frequencies_hz = []", "segments[1].frequencies_hz", "has 0 entries"),
    ("frequencies_hz = [5.0]", "frequencies_hz = [0.1]", "segments[1].frequencies_hz[1]", "is 0.1, which is too small"),
    ("amplitude_n = 1.0", "amplitude_mN = 1000", "segments[1].amplitude_mN", "did you mean amplitude_n"),
    ("amplitude_n = 1.0", "amplitude_n = 2.5", "segments[1].amplitude_n", "is 2.5 N, above safety.stimulus_cap_n"),
    ("to_hz = 100.0", "to_hz = 1", "segments[2].to_hz", "is 1.0 Hz, not above from_hz"),
    ("to_hz = 100.0", "to_hz = 1000", "segments[2].to_hz", "is 1000, which is too large"),
    ("to_hz = 100.0", 'to_hz = 100.0\nrole = "training"', "segments[2].role", 'is "training"'),
    ("[safety]", "[safety]\nleast_amplitude_n = 0.0", "safety.least_amplitude_n", "is no key of [safety]"),
]


@pytest.mark.parametrize(("old", "new", "key", "problem"), RECORDINGS)
def test_recordings_are_refused_with_the_segment_counted_from_one(old, new, key, problem):
    error = refused(changed(RECORDING, old, new))
    assert len(error.problems) == 1
    assert error.key == key
    assert problem in error.problem


def test_what_a_recording_allows_is_reported():
    assert refused(changed(RECORDING, 'kind = "sine"', 'kind = "sin"')).allowed == '"multisine" or "sine" or "sweep"'
    assert refused(changed(RECORDING, "amplitude_n = 1.0", "amplitude_n = 2.5")).allowed == (
        "above 0 and at most 2.0 N, the cap"
    )
    assert refused(changed(RECORDING, "to_hz = 100.0", "to_hz = 1")).allowed == "above 1.0 Hz, the from_hz"


def test_a_sweep_of_less_than_a_cycle_is_refused_with_the_least_period():
    short = 'kind = "sweep"\nalong = "x"\nfrom_hz = 1.0\nto_hz = 2.0\nduration_s = 0.5\namplitude_n = 1.0\n'
    error = refused(f"{RECORDING}\n\n[[segments]]\n{short}")
    assert (error.problem, error.allowed) == ("is 0.5 s, less than a cycle of the sweep", "0.693148 s or more")


def test_an_entry_that_is_no_table_is_refused():
    text = RECORDING[: RECORDING.index("[[segments]]")].replace("[safety]", "segments = [3]\n[safety]")
    error = refused(text)
    assert (error.key, error.problem) == ("segments[1]", "is 3")
    assert error.allowed == 'a table whose kind is "multisine", "sine" or "sweep"'


MULTISINE = """

[[segments]]
kind = "multisine"
along = "all"
from_hz = 5.0
to_hz = 35.0
duration_s = 2.0
amplitude_n = 1.0
"""


def test_a_multisine_may_be_along_all_axes_and_has_its_defaults():
    segment = load_protocol(RECORDING + MULTISINE, "mine.toml").segments[-1]
    assert (segment.along, segment.odd_only, segment.periods, segment.realisations) == ("all", True, 2, 1)
    assert segment.role == ""


@pytest.mark.parametrize(
    ("old", "new", "problem", "allowed"),
    [
        ("duration_s = 2.0", "duration_s = 0.02", "is 0.02 s, too short for the band", "which lie 100 Hz apart here"),
        ("to_hz = 35.0", "to_hz = 5.4", "is 2.0 s, too short for the band", "which lie 1 Hz apart here"),
        ("to_hz = 35.0", "to_hz = 5.0", "is 5.0 Hz, not above from_hz", "above 5.0 Hz, the from_hz"),
        ("amplitude_n = 1.0", "amplitude_n = 2.5", "is 2.5 N, above safety.stimulus_cap_n", "at most 2.0 N"),
    ],
)
def test_a_multisine_that_cannot_be_is_refused(old, new, problem, allowed):
    error = refused(RECORDING + changed(MULTISINE, old, new))
    assert len(error.problems) == 1
    assert problem in error.problem
    assert allowed in error.allowed


def test_whole_numbers_do_for_real_ones(threshold_text):
    text = changed(threshold_text, "start_n = 1.0", "start_n = 1")
    assert load_protocol(text, "mine.toml") == load_protocol(threshold_text, "mine.toml")


def test_texts_become_the_choices_they_name(threshold):
    assert threshold.staircase.step_change is StepChange.AFTER_REVERSAL


@given(
    st.dictionaries(
        st.sampled_from(["name", "kind", "title", "stimulus", "staircase", "steps", "safety", "segments", "x"]),
        st.recursive(
            st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.just("study"),
            lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
            max_leaves=8,
        ),
    ),
    st.sampled_from(["study", "recording"]),
)
@settings(max_examples=50, deadline=None)
def test_nonsense_is_refused_in_words_and_never_crashes(values, kind):
    with pytest.raises(ProtocolError) as caught:
        protocol_from_values({**values, "kind": kind}, "nonsense")
    assert all(problem.key and problem.problem and problem.allowed for problem in caught.value.problems)
