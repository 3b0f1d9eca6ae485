"""Sessions with probes between trials: strength, order, faults, a handle that is not free, a program that ends."""

from dataclasses import replace

import numpy as np
import pytest

from protocols.definition.probes import ProbeSettings
from protocols.document.dumping import dump_protocol
from study.devices.safe import SafeDevice
from study.errors import UserInterruptError
from study.session.facts.events import (
    PauseTaken,
    ProbeMeasured,
    ProbePlayed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.state.fold import apply_event
from study.session.state.presentation_check import LogContradictionError
from study.session.state.probe_state import ProbeState, apply_break
from study.session.stimulus.probe_stimulus import make_probe_stimulus, make_reference_commands
from study.session.views.participant_views import PlayingNotice
from study.store.formats.recording_file import read_recording
from study.store.sessions.event_log import EventLog, read_log
from study.workflows.session.simulated_display import SimulatedDisplay
from study.workflows.trial import play_probe
from study.workflows.trial.play_probe import NO_QUESTION
from study.workflows.trial.session_supervisor import SessionSupervisor

PROBES = ProbeSettings(levels_n=(0.2, 0.4, 0.8), interval_s=20.0, reference_s=3.0)


def with_probes(protocol):
    return replace(protocol, probes=PROBES, measurement=replace(protocol.measurement, keep_s=1.0))


@pytest.fixture
def probed(sitter):
    return add_probes(sitter)


@pytest.fixture
def briefly_probed(brief):
    brief.protocol = replace(brief.protocol, stimulus=replace(brief.protocol.stimulus, frequencies_hz=(35.0,)))
    return add_probes(brief)


def add_probes(sitter):
    sitter.protocol = with_probes(sitter.protocol)
    sitter.text = dump_protocol(sitter.protocol)
    return sitter


@pytest.fixture(scope="module")
def whole(tmp_path_factory, sitter_of, small_protocol):
    """A finished session with probes, which no test changes."""
    return add_probes(sitter_of(tmp_path_factory.mktemp("probed") / "data", small_protocol, "")).whole()


def events_of(folder):
    return read_log(folder.log).events


def trials_of(done):
    return [(t.run, t.trial, t.level_n, t.answer) for t in done.state.trials if t.is_valid]


@pytest.mark.parametrize("factor", [1e12, 1e-12])
def test_a_sensor_whose_sensitivity_is_set_wrong_ends_no_session(briefly_probed, monkeypatch, factor):
    """The log refused its accelerations, and each answer ended the program."""
    release = SafeDevice.release

    def release_scaled(device):
        if (recording := (result := release(device)).recording) is None:
            return result
        response = replace(recording.response, samples=factor * recording.response.samples)
        return replace(result, recording=replace(recording, response=response))

    monkeypatch.setattr(SafeDevice, "release", release_scaled)
    done = briefly_probed.whole()
    assert done.end_reason == "" and done.state.closed
    probe = next(event for event in events_of(done.folder) if isinstance(event, ProbeMeasured))
    assert probe.rms_mps2 is None if factor > 1 else probe.apparent_mass_kg is None
    assert all(trial.delivered_mps2 is None for trial in done.state.trials) == (factor > 1)


def test_no_probe_is_stronger_than_its_own_cap_and_all_come_between_trials(whole):
    done = whole
    assert done.end_reason == ""
    events = events_of(done.folder)
    played = {e.number: e for e in events if isinstance(e, ProbePlayed)}
    measured = [e for e in events if isinstance(e, ProbeMeasured)]
    assert len([e for e in played.values() if e.kind == "hand"]) >= 4
    for kept in measured:
        recording = read_recording(done.folder.path / kept.recording)
        peak_n = float(np.linalg.norm(recording.excitation.samples, axis=1).max())
        highest_n = PROBES.reference_n if played[kept.number].kind == "reference" else PROBES.probe_cap_n
        assert 0 < peak_n <= highest_n * (1 + 1e-6)
        assert recording.position is not None
    open_trial = False
    for event in events:
        open_trial = isinstance(event, TrialPresented) or (
            open_trial and not isinstance(event, TrialMeasured | TrialSpoiled)
        )
        assert not (open_trial and isinstance(event, ProbePlayed | ProbeMeasured))


@pytest.mark.slow
def test_levels_come_in_turn_and_never_sooner_than_the_protocol_says(whole):
    hand = [e for e in events_of(whole.folder) if isinstance(e, ProbePlayed) and e.kind == "hand"]
    assert [e.level_n for e in hand] == [PROBES.levels_n[i % 3] for i in range(len(hand))]
    assert min(np.diff([e.monotonic_s for e in hand])) >= PROBES.interval_s


def test_a_probes_answer_never_reaches_that_of_a_trial(played, whole):
    assert trials_of(played) == trials_of(whole)


def test_a_probe_is_on_the_disk_before_the_device_moves(briefly_probed, monkeypatch):
    calls, hold, append = [], SafeDevice.hold, EventLog.append
    monkeypatch.setattr(SafeDevice, "hold", lambda self, stimulus: calls.append("hold") or hold(self, stimulus))
    monkeypatch.setattr(EventLog, "append", lambda self, event: append(self, event) or calls.append(event.event))
    briefly_probed.whole()
    for place, call in enumerate(calls):
        if call == "probe_played" and calls[place + 1] != "probe_measured":
            assert calls[place + 1] == "hold"
    assert "probe_played" in calls


def test_a_handle_that_is_still_held_gets_no_reference_and_the_session_goes_on(briefly_probed, monkeypatch):
    monkeypatch.setattr(SafeDevice, "simulate_hand", lambda self, on_handle: None)
    done = briefly_probed.whole()
    events = events_of(done.folder)
    assert done.end_reason == ""
    assert not [e for e in events if isinstance(e, ProbePlayed) and e.kind == "reference"]
    assert any("seems to be held" in e.trouble for e in events if isinstance(e, ProbeMeasured))


@pytest.mark.parametrize(
    "factor",
    [pytest.param(-1.0, marks=pytest.mark.slow), 0.0, pytest.param(np.nan, marks=pytest.mark.slow)],
    ids=["turned over", "dead", "no number"],
)
def test_a_sensor_that_is_wrong_never_frees_a_held_handle_and_ends_no_session(briefly_probed, monkeypatch, factor):
    hold = play_probe.release_device

    def wrong(sitting):
        played = hold(sitting)
        response = played.recording.response
        spoiled = replace(response, samples=factor * response.samples)
        return replace(played, recording=replace(played.recording, response=spoiled))

    monkeypatch.setattr(SafeDevice, "simulate_hand", lambda self, on_handle: None)
    monkeypatch.setattr(play_probe, "release_device", wrong)
    done = briefly_probed.whole()
    events = events_of(done.folder)
    assert done.end_reason == ""
    assert not [e for e in events if isinstance(e, ProbePlayed) and e.kind == "reference"]
    assert all(e.apparent_mass_kg is None and e.trouble for e in events if isinstance(e, ProbeMeasured))


@pytest.mark.slow
def test_the_free_handle_is_compared_at_the_level_of_the_probe_in_the_hand(whole):
    events = [e for e in events_of(whole.folder) if isinstance(e, ProbePlayed)]
    free = next(number for number, e in enumerate(events) if e.kind == "free")
    assert events[free].level_n == events[free - 1].level_n
    assert events[free - 1].kind == "hand"


@pytest.mark.parametrize(("paused_s", "since_s", "mass_kg"), [(200.0, None, None), (30.0, 0.0, 0.4)])
def test_after_a_pause_no_probe_compares_with_the_grip_before_it(paused_s, since_s, mass_kg):
    before = ProbeState(
        probe_count=3,
        hand_probe_count=2,
        since_probe_s=50.0,
        is_reference_done=True,
        hand_mass_kg=0.4,
        hand_level_n=0.2,
    )
    after = apply_break(before, PauseTaken("2026-01-01T00:00:00.000+00:00", "participant", paused_s), PROBES)
    assert (after.since_probe_s, after.hand_mass_kg, after.is_reference_done) == (since_s, mass_kg, paused_s < 120)


def test_a_stop_while_the_hand_lets_go_plays_nothing(probed, monkeypatch):
    begin, begun = SessionSupervisor.start_activity, []

    def stop_at_the_form(self, activity):
        begun.append(activity)
        begin(self, activity)
        if activity == "form" and "probe" in begun:
            self._device.stop()
            self.stop_requester = "experimenter"

    monkeypatch.setattr(SessionSupervisor, "start_activity", stop_at_the_form)
    done = probed.whole()
    assert done.end_reason == "the experimenter stopped the session"
    assert [e.kind for e in events_of(done.folder) if isinstance(e, ProbePlayed)] == ["hand"]


def test_a_program_that_ends_within_a_probe_repeats_and_loses_none(probed, monkeypatch):
    show, shown = SimulatedDisplay.show_playing, []

    def ends_within_the_fourth(self, notice: PlayingNotice, sign_of_life):
        shown.append(notice.title)
        if notice.title == NO_QUESTION and shown.count(NO_QUESTION) == 4:
            raise KeyboardInterrupt
        return show(self, notice, sign_of_life)

    monkeypatch.setattr(SimulatedDisplay, "show_playing", ends_within_the_fourth)
    with pytest.raises(UserInterruptError):
        probed.whole()
    (folder,) = (f for f in probed.data.iterdir() if f.is_dir())
    from study.store.sessions.archive import SessionFolder

    done = probed.resumed(SessionFolder(folder))
    assert done.end_reason == ""
    events = events_of(done.folder)
    numbers = [e.number for e in events if isinstance(e, ProbePlayed)]
    assert numbers == list(range(len(numbers)))
    lost = set(numbers) - {e.number for e in events if isinstance(e, ProbeMeasured)}
    assert len(lost) == 1
    assert len([e for e in events if isinstance(e, ProbePlayed) and e.kind == "reference"]) == 2


def test_a_probe_within_a_trial_or_above_its_cap_is_refused_by_the_log(whole):
    state = replace(whole.state, closed=False)
    number = state.sitting.probing.probe_count
    probe = ProbePlayed("2026-01-01T00:00:00.000+00:00", number, "hand", 0.8)
    with pytest.raises(LogContradictionError, match="allows 1 N"):
        apply_event(state, replace(probe, level_n=1.01))
    with pytest.raises(LogContradictionError, match="is the next"):
        apply_event(state, replace(probe, number=number + 1))
    within = replace(state, presented=TrialPresented.__new__(TrialPresented))
    with pytest.raises(LogContradictionError, match="while a trial is open"):
        apply_event(within, probe)


def test_a_stimulus_above_the_cap_is_not_even_made():
    with pytest.raises(ValueError, match="not within its cap"):
        make_probe_stimulus(PROBES, 1.01, 1000.0)


def test_the_forces_are_odd_lines_one_axis_each_and_the_same_in_probe_and_reference():
    loop = make_probe_stimulus(PROBES, 0.8, 1000.0).loop.samples
    lines = np.abs(np.fft.rfft(loop, axis=0)) > 1e-6
    assert not lines[::2].any()
    assert lines.sum(axis=1).max() == 1
    assert lines.sum(axis=0).min() >= 9
    commands, segments = make_reference_commands(PROBES, 1000.0)
    for segment in segments:
        played = commands.samples[segment.start : segment.start + 1000]
        assert np.allclose(played, segment.amplitude / 0.8 * loop)
        assert (segment.stop - segment.start) % segment.period == 0
    assert [(each.amplitude, each.role) for each in segments] == [
        (1.0, "fit"),
        (1.0, "test"),
        (0.5, "fit"),
        (0.5, "test"),
    ]


@pytest.mark.slow
def test_a_reference_that_is_cut_short_by_a_pause_lets_go_and_the_session_goes_on_held(probed, monkeypatch):
    glance, hands = SessionSupervisor.keep_alive, []

    def asks_for_a_pause(self):
        if self._activity == "reference":
            calls.append(1)
            self.pause_requester = "experimenter" if len(calls) > 2 else self.pause_requester
        return glance(self)

    calls: list[int] = []
    simulate = SafeDevice.simulate_hand
    monkeypatch.setattr(SessionSupervisor, "keep_alive", asks_for_a_pause)
    monkeypatch.setattr(SafeDevice, "simulate_hand", lambda self, on: hands.append(on) or simulate(self, on))
    done = probed.whole()
    assert done.end_reason == ""
    assert hands == [False, True]
    events = events_of(done.folder)
    (cut,) = (e for e in events if isinstance(e, ProbeMeasured) and e.trouble)
    assert cut.trouble == "it was cut short"
    assert cut.recording is None
    assert 0 < cut.vibrated_s < 1  # what was played until then


def test_a_stop_within_a_reference_ends_the_sitting_without_force(probed, monkeypatch):
    glance = SessionSupervisor.keep_alive

    def asks_for_a_stop(self):
        if self._activity == "reference":
            self._device.stop()
            self.stop_requester = "experimenter"
        return glance(self)

    monkeypatch.setattr(SessionSupervisor, "keep_alive", asks_for_a_stop)
    done = probed.whole()
    assert "the experimenter stopped the session" in done.end_reason
    assert done.state.answers == 0
