"""The shipped files say what the paper says, and say it in writing."""

from importlib.resources import files

import pytest

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import MultisineSegment, SineSegment, SweepSegment
from protocols.definition.staircase_rule import StepChange, StepPhase
from protocols.document.explain import explain_protocol
from protocols.document.loading import load_protocol

NAMES = tuple(sorted(path.name.removesuffix(".toml") for path in files("protocols").iterdir() if ".toml" in path.name))


def text_of(name: str) -> str:
    return files("protocols").joinpath(f"{name}.toml").read_text("utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_every_shipped_protocol_loads_and_bears_its_files_name(name):
    assert load_protocol(text_of(name), name).name == name


@pytest.mark.parametrize("name", NAMES)
def test_no_line_is_too_long_for_a_terminal_but_the_source(name):
    assert all(len(line) <= 120 for line in text_of(name).splitlines() if not line.startswith("source"))


def test_the_published_study_has_the_published_numbers(threshold):
    assert threshold.stimulus.frequencies_hz == (5.0, 15.0, 25.0, 35.0, 45.0)
    rule = threshold.staircase
    assert (rule.start_n, rule.cap_n) == (1.0, 3.0)
    assert (rule.up_after_wrong, rule.down_after_right) == (1, 3)
    assert rule.steps == (StepPhase(4.0, 3), StepPhase(1.0, 10))
    assert (rule.reversals, rule.averaged_reversals) == (13, 10)
    assert threshold.training.frequencies_hz == (5.0,)
    assert threshold.trial.time_limit_s == 0.0
    assert threshold.schedule.order == "random"


def test_the_open_choices_are_the_ones_that_are_documented(threshold):
    rule = threshold.staircase
    assert rule.step_change is StepChange.AFTER_REVERSAL
    assert not rule.initial_one_up_one_down
    assert (rule.reversal, rule.at_cap, rule.mean) == ("level_direction", "clamp", "newton")
    assert threshold.stimulus.quantity == "commanded_force"
    assert threshold.stimulus.onset_polarity == "random"
    assert (threshold.trial.feedback, threshold.schedule.directions) == ("none", "independent")
    assert threshold.schedule.labels == "fixed"


def test_the_published_study_writes_out_every_value_it_has(threshold, threshold_text):
    written = {line.split("=")[0].strip() for line in threshold_text.splitlines() if "=" in line}
    keys = {field.key.rpartition(".")[2] for field in explain_protocol(threshold)}
    assert keys <= written


OPEN = (
    *("fade_in_s", "fade_out_s", "fade_shape", "onset_polarity", "plane", "symmetry_deg", "step_change"),
    *("initial_one_up_one_down", "reversal", "at_cap", "mean", "directions", "labels", "feedback", "pause_between_s"),
    *("after_run_s", "after_trials", "natural_frequency_hz"),
)


@pytest.mark.parametrize("key", OPEN)
def test_what_the_paper_leaves_open_is_said_to_be_open_and_why(threshold_text, key):
    lines = threshold_text.splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith(f"{key} = "))
    above = at
    while lines[above - 1].startswith("#"):
        above -= 1
    assert "open:" in " ".join(lines[above : at + 1])


def test_training_alone_follows_the_rule_of_the_study(threshold):
    training = load_protocol(text_of("direction_training"), "direction_training.toml")
    assert training.staircase == threshold.staircase
    assert training.directions == threshold.directions
    assert training.training == threshold.training
    assert training.stimulus.frequencies_hz == ()


def test_the_ellipsoid_recording_is_the_published_one():
    protocol = load_protocol(text_of("ellipsoid"), "ellipsoid.toml")
    (sines,) = protocol.segments
    assert isinstance(sines, SineSegment)
    assert sines.frequencies_hz == (5.0, 10.0, 15.0, 25.0, 35.0)
    assert (sines.amplitude_n, sines.along, protocol.hand) == (1.0, "direction_1", "none")
    assert all((sines.duration_s * frequency).is_integer() for frequency in sines.frequencies_hz)


def test_the_sweep_recording_is_the_published_one():
    protocol = load_protocol(text_of("sweep"), "sweep.toml")
    assert [segment.along for segment in protocol.segments] == ["x", "y", "z"]
    assert all(isinstance(segment, SweepSegment) for segment in protocol.segments)
    assert {(s.from_hz, s.to_hz, s.duration_s, s.periods, s.amplitude_n) for s in protocol.segments} == {
        (1.0, 500.0, 30.0, 2, 1.0)
    }
    assert (protocol.spring.natural_frequency_hz, protocol.hand) == (3.5, "none")


@pytest.mark.parametrize(
    ("name", "sweeps_hz", "tested_hz", "hand"),
    [
        ("sweep_band", (4.5, 37.0), (5.0, 35.0), "none"),
        ("sweep_study", (4.5, 55.0), (5.0, 50.0), "none"),
        ("sweep_hand", (4.5, 55.0), (5.0, 50.0), "held"),
    ],
)
def test_sweeps_of_a_band_are_fitted_and_a_multisine_on_all_axes_is_held_out(name, sweeps_hz, tested_hz, hand):
    protocol = load_protocol(text_of(name), name)
    *sweeps, held_out = protocol.segments
    assert [(sweep.along, sweep.role) for sweep in sweeps] == [("x", "fit"), ("y", "fit"), ("z", "fit")]
    assert {(sweep.from_hz, sweep.to_hz) for sweep in sweeps} == {sweeps_hz}
    assert min(sweep.periods for sweep in sweeps) >= 3
    assert isinstance(held_out, MultisineSegment)
    assert (held_out.along, held_out.role, held_out.duration_s) == ("all", "test", 10.0)
    assert (held_out.from_hz, held_out.to_hz) == tested_hz
    assert protocol.hand == hand


def test_one_recording_only_is_made_in_a_hand_and_it_pushes_less():
    protocols = [load_protocol(text_of(name), name) for name in NAMES]
    recordings = [protocol for protocol in protocols if isinstance(protocol, RecordingProtocol)]
    assert [protocol.name for protocol in recordings if protocol.hand == "held"] == ["sweep_hand"]
    caps_n = {protocol.name: (protocol.safety.stimulus_cap_n, protocol.safety.total_cap_n) for protocol in recordings}
    in_hand = caps_n.pop("sweep_hand")
    assert all(in_hand[0] < stimulus_n and in_hand[1] < total_n for stimulus_n, total_n in caps_n.values())


def test_the_multisine_recording_tells_noise_from_distortion():
    protocol = load_protocol(text_of("multisine"), "multisine.toml")
    assert [segment.along for segment in protocol.segments] == ["x", "y", "z"]
    assert all(s.odd_only and s.periods >= 3 and s.realisations >= 2 for s in protocol.segments)
    assert len({segment.seed for segment in protocol.segments}) == 3
    assert {(segment.from_hz, segment.to_hz) for segment in protocol.segments} == {(1.0, 200.0)}
