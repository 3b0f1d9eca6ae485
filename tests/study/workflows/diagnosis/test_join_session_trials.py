"""A session's trials as one recording: by frequency, levels grouped, a lead to settle in, and only what is whole."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.devices.clock import VirtualClock
from study.errors import StudyError, WrongUseError
from study.store.formats.recording_file import read_recording, write_recording
from study.workflows.diagnosis.join_session_trials import (
    LEAD_S,
    LONGEST_TOTAL_S,
    estimate_spring_stiffness,
    join_session_trials,
)
from study.workflows.session.conduct_session import conduct_new
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_participant import make_simulated_participant

RATE_HZ = 1000


@pytest.fixture(scope="module")
def session(tmp_path_factory, small_text):
    from protocols.document.loading import load_protocol

    data = tmp_path_factory.mktemp("data")
    plan = SessionPlan(
        protocol=load_protocol(small_text, "small.toml"), protocol_text=small_text, protocol_locked=False,
        subject="P01", observer="ideal", seed=3, data_folder=data, participant_number=0,
    )  # fmt: skip
    return conduct_new(plan, "simulated", make_simulated_participant("ideal", 3, VirtualClock())).folder.path


@pytest.mark.slow
def test_all_trials_are_one_recording_with_its_frequencies_one_after_the_other(session):
    found = join_session_trials(session, seed=1)
    assert found.simulated and found.name == session.name
    trials = len(list((session / "recordings").glob("*.h5")))
    assert len(found.recording.segments) == trials == len(found.parents) - 1
    assert found.parents[0].name == "events.jsonl"
    heard = [loudest_hz(found.recording, segment) for segment in found.recording.segments]
    assert heard == sorted(heard) and set(heard) == {5, 25, 35}


@pytest.mark.slow
def test_before_each_trial_its_own_command_continues_with_nothing_to_compare(session):
    one = join_session_trials(session, seed=1).recording
    lead = round(LEAD_S * RATE_HZ)
    first = one.segments[0]
    assert first.start == lead and first.kind == "sine"
    assert np.isnan(one.response.samples[:lead]).all() and one.position is None
    assert np.isfinite(one.command.samples).all()
    assert (one.command.samples[0] == 0).all()
    period = first.period
    np.testing.assert_allclose(one.command.samples[lead - 1], one.command.samples[lead + period - 1], atol=1e-6)


def test_what_was_decided_is_played_and_the_spring_is_distinguished(session):
    found = join_session_trials(session, seed=1)
    one = read_recording(found.parents[1])
    assert found.spring_n_per_m == pytest.approx(137, abs=1)
    first = found.recording.segments[0]
    np.testing.assert_array_equal(
        found.recording.command.samples[first.start : first.stop], one.excitation.samples[: first.stop - first.start]
    )


@pytest.mark.slow
def test_without_positions_no_spring_is_known(session):
    one = read_recording(join_session_trials(session, seed=1).parents[1])
    assert estimate_spring_stiffness([one]) == pytest.approx(137, abs=1)
    assert (
        estimate_spring_stiffness([replace(one, position=None)])
        == estimate_spring_stiffness([replace(one, excitation=None)])
        == 0.0
    )


@pytest.mark.slow
def test_levels_are_grouped_and_of_each_frequency_one_trial_in_four_is_a_test(session):
    one = join_session_trials(session, seed=1).recording
    groups = {}
    for segment in one.segments:
        groups.setdefault((loudest_hz(one, segment), segment.amplitude), []).append(segment.role)
    assert len(groups) > 3
    assert all(roles.count("test") == len(roles) // 4 for roles in groups.values())
    levels = sorted({segment.amplitude for segment in one.segments})
    steps = np.diff(20 * np.log10(levels)) / 4
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def loudest_hz(recording, segment):
    lines = np.abs(np.fft.rfft(recording.command.samples[segment.start : segment.stop], axis=0)).sum(axis=1)
    return round(np.argmax(lines) * RATE_HZ / (segment.stop - segment.start))


@pytest.mark.slow
def test_another_seed_keeps_other_trials_for_the_test(session):
    roles = [[segment.role for segment in join_session_trials(session, seed).recording.segments] for seed in (1, 1, 2)]
    assert roles[0] == roles[1] != roles[2]


@pytest.mark.slow
def test_only_what_is_there_is_claimed(session):
    said = join_session_trials(session, seed=1).remarks
    assert "a hand on the handle" in said[0]
    assert "Effects that show only there cannot be found here." in said[0]
    assert len(said) == 2


@pytest.mark.slow
def test_trials_with_gaps_or_flags_are_left_out_and_reported(session, tmp_path):
    copy = copied(session, tmp_path)
    first, second, *_ = sorted((copy / "recordings").glob("*.h5"))
    one = read_recording(first)
    gap = one.response.samples.copy()
    gap[10] = np.nan
    write_recording(first, replace(one, response=replace(one.response, samples=gap)), overwrite=True)
    other = read_recording(second)
    write_recording(second, replace(other, meta={**other.meta, "flags": ["missed ticks"]}), overwrite=True)
    whole, less = (join_session_trials(folder, 1) for folder in (session, copy))
    count = [len(found.recording.segments) for found in (whole, less)]
    assert count[0] - count[1] == 2
    assert any(remark.startswith("2 trials were left out") for remark in less.remarks)


@pytest.mark.slow
def test_a_long_session_is_thinned_alike_at_all_levels(session, tmp_path):
    copy = copied(session, tmp_path)
    for path in (copy / "recordings").glob("*.h5"):
        path.unlink()
    for number in range(60):
        level = (0.5, 2.0)[number % 2]
        write_recording(copy / "recordings" / f"run-09_trial-{number:03d}_attempt-0.h5", trial(level, seconds=4))
    found = join_session_trials(copy, 1)
    segments = found.recording.segments
    assert sum(segment.stop - segment.start for segment in segments) <= (LONGEST_TOTAL_S + 8) * RATE_HZ
    counts = [sum(s.amplitude == level for s in segments) for level in {s.amplitude for s in segments}]
    assert len(counts) == 2 and counts[0] == counts[1] > 5
    assert found.remarks[0].startswith("16 of the 60 trials")


@pytest.mark.slow
def test_a_recording_that_was_changed_since_is_left_out(session, tmp_path):
    copy = copied(session, tmp_path)
    first, second, *_ = sorted((copy / "recordings").glob("*.h5"))
    first.write_bytes(second.read_bytes())
    found = join_session_trials(copy, 1)
    assert first not in found.parents
    assert any("was changed since" in remark for remark in found.remarks)


def test_a_session_without_a_whole_trial_is_refused(session, tmp_path):
    copy = copied(session, tmp_path)
    for path in (copy / "recordings").glob("*.h5"):
        path.unlink()
    with pytest.raises(StudyError, match="has 0 recordings of trials, and none can be used") as refused:
        join_session_trials(copy, 1)
    assert refused.value.title == "This session holds nothing to diagnose"


def test_a_folder_that_is_no_session_is_refused(tmp_path):
    with pytest.raises(WrongUseError, match="neither a session folder nor"):
        join_session_trials(tmp_path, 1)


def copied(session, tmp_path):
    import shutil

    return shutil.copytree(session, tmp_path / session.name)


def trial(level, seconds) -> Recording:
    t = np.arange(seconds * RATE_HZ)[:, None] / RATE_HZ
    wave = level * np.sin(2 * np.pi * 25 * t) * np.array([[1.0, 0.0, 0.0]])
    force = Signal(wave, RATE_HZ, "force", "N", ("fx", "fy", "fz"))
    felt = Signal(4 * wave, RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az"))
    meta = {"frequency_hz": 25.0, "level_n": level, "flags": []}
    return Recording("bench", force, felt, segments=(Segment(0, len(t), "sine", level, 40, ""),), meta=meta)
