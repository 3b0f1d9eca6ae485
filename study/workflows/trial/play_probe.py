"""A probe between two trials, and the reference without a hand: logged, played, kept. Neither ever voids a trial."""

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from equalizer.signals.recording import Recording
from protocols.definition.probes import PERIOD_S
from study.devices.device import Fault, PlaybackResult
from study.session.facts.events import ProbeMeasured, ProbePlayed
from study.session.state.probe_state import Probe
from study.session.state.state import SessionState
from study.session.stimulus.probe_stimulus import HELD_S, make_probe_stimulus, make_reference_commands
from study.session.views.form_views import FormKind
from study.session.views.forms import judge_form, make_form, make_take_handle_form, make_words
from study.session.views.views import PlayingNotice, Unanswered
from study.store.disk.provenance import list_versions
from study.store.sessions.trial_recordings import probe_name, save_trial_recording
from study.workflows.trial.after_trial import AfterTrial, check_end_request, early_end_result, reason_to_leave
from study.workflows.trial.present_trial import await_handle
from study.workflows.trial.sitting import Sitting, log_and_apply, notify_experimenter, release_device

LIGHTER_WITHOUT_A_HAND = 0.9
"""Largest ratio of the apparent mass after the hand let go to that just before, with the hand."""

NO_QUESTION = "Nothing to answer: the device is measured"
"""Shown while a probe or the reference plays."""

Kind = Literal["hand", "free", "reference"]
"""With the hand on the handle; test whether it is free; reference without a hand."""


class _EndedEarlyError(Exception):
    """A stop, a pause or a fault while the reference plays."""


@dataclass(frozen=True, slots=True)
class _Measured:
    state: SessionState
    reply: Unanswered | None
    """Why it was cut short; None where it was not."""
    play_result: PlaybackResult
    mass_kg: float | None
    """Apparent mass of the handle; None without a recording."""


def play_probe(state: SessionState, probe: Probe, sitting: Sitting) -> AfterTrial:
    """Play a probe with the hand on the handle, after waiting for the hand as a trial does."""
    hindrance = await_handle(state, sitting)
    if hindrance is not None:
        return early_end_result(state, hindrance)
    if (ended := check_end_request(state, sitting)) is not None:
        return ended
    measured = _play_and_measure(state, "hand", probe.level_n, sitting)
    return _after_probe(measured.state, measured.reply, measured.play_result, sitting)


def play_reference(state: SessionState, sitting: Sitting) -> AfterTrial:
    """Ask for a free handle, test with a probe whether it is, and only then play the reference."""
    form = make_form(state.protocol, FormKind.HANDLE)
    assert form is not None, "a reference is due only where the protocol has one"
    held_kg = state.sitting.probing.hand_mass_kg
    if held_kg is None:
        return AfterTrial(_decline(state, "what the handle weighs in the hand could not be measured", sitting))
    sitting.supervisor.start_activity("form")
    if not judge_form(state.protocol, form, sitting.display.fill_in(form)).passed:
        return AfterTrial(_decline(state, "the handle was not free", sitting))
    if (ended := check_end_request(state, sitting)) is not None:
        return ended
    sitting.device.simulate_hand(False)
    outcome = _test_and_play(state, held_kg, sitting)
    if outcome.end_reason:
        return outcome
    sitting.device.simulate_hand(True)
    if not outcome.pause:
        sitting.supervisor.start_activity("form")
        sitting.display.fill_in(make_take_handle_form(make_words(state.protocol)))
    return outcome


def _test_and_play(state: SessionState, held_kg: float, sitting: Sitting) -> AfterTrial:
    # At the level of the probe that it is compared with: the influence of friction and springs depends on the level.
    test = _play_and_measure(state, "free", state.sitting.probing.hand_level_n, sitting)
    outcome = _after_probe(test.state, test.reply, test.play_result, sitting)
    if outcome.end_reason or outcome.pause or outcome.fault is not Fault.NONE:
        return outcome
    if test.mass_kg is None:
        return AfterTrial(_decline(test.state, "whether the handle is free could not be measured", sitting))
    if test.mass_kg > LIGHTER_WITHOUT_A_HAND * held_kg:
        reason = f"the handle seems to be held: it answers like {test.mass_kg:.2f} kg, and {held_kg:.2f} kg in the hand"
        return AfterTrial(_decline(test.state, reason, sitting))
    return _play_free(test.state, sitting)


def _decline(state: SessionState, reason: str, sitting: Sitting) -> SessionState:
    notify_experimenter(f"No reference was played: {reason}.", sitting)
    number = state.sitting.probing.probe_count
    event = ProbeMeasured(utc=sitting.clock.utc(), number=number, vibrated_s=0.0, trouble=reason)
    return log_and_apply(state, event, sitting)


def _play_free(state: SessionState, sitting: Sitting) -> AfterTrial:
    probes, rate_hz = state.protocol.probes, sitting.device.info.sample_rate_hz
    commands, segments = make_reference_commands(probes, rate_hz)
    state = _log_played(state, "reference", probes.reference_n, sitting)
    sitting.supervisor.start_activity("reference")
    sitting.display.trouble(f"Hands off: the reference plays for {commands.duration_s:.0f} s.")

    def attend(share: float) -> None:
        if not sitting.supervisor.sign_of_life():
            raise _EndedEarlyError

    try:
        play_result = sitting.device.play(commands, attend)
    except _EndedEarlyError:
        fault = sitting.device.fault()
        state = _log_measured(state, None, 0.0, "it was cut short", sitting).state
        reply = sitting.supervisor.resolve(
            Unanswered("the reference was cut short", ends_sitting=False, repeat_requested=True)
        )
        outcome = early_end_result(state, reply) if isinstance(reply, Unanswered) else AfterTrial(state)
        return replace(outcome, end_reason=outcome.end_reason or reason_to_leave(fault), fault=fault)
    recording = None if play_result.recording is None else replace(play_result.recording, segments=segments)
    trouble = "" if recording is not None else play_result.health.fault.value
    state = _log_measured(state, recording, commands.duration_s, trouble, sitting).state
    return AfterTrial(state, end_reason=reason_to_leave(play_result.health.fault), fault=play_result.health.fault)


def _play_and_measure(state: SessionState, kind: Kind, level_n: float, sitting: Sitting) -> _Measured:
    """Log, play through the same port and under the same signs of life as a demonstration, and keep the recording."""
    stimulus = make_probe_stimulus(state.protocol.probes, level_n, sitting.device.info.sample_rate_hz)
    state = _log_played(state, kind, level_n, sitting)
    sitting.supervisor.start_activity("probe")
    sitting.device.hold(stimulus)
    notice = PlayingNotice(NO_QUESTION, 0, HELD_S, picture=None)
    reply = sitting.display.show_playing(notice, sitting.supervisor.sign_of_life)
    play_result = release_device(sitting)
    missed = play_result.health.missed_ticks
    trouble = play_result.health.fault.value if play_result.health.fault is not Fault.NONE else ""
    if not trouble and missed > state.protocol.measurement.missed_ticks_limit * max(play_result.health.ticks, 1):
        trouble = f"{missed} ticks of it were missed"
    seconds = play_result.health.ticks / sitting.device.info.sample_rate_hz
    ended = _log_measured(state, None if trouble else play_result.recording, seconds, trouble, sitting)
    return replace(ended, reply=reply, play_result=play_result)


def _log_played(state: SessionState, kind: Kind, level_n: float, sitting: Sitting) -> SessionState:
    number = state.sitting.probing.probe_count
    return log_and_apply(state, ProbePlayed(sitting.clock.utc(), number, kind, level_n), sitting)


def _log_measured(
    state: SessionState, recording: Recording | None, seconds: float, trouble: str, sitting: Sitting
) -> _Measured:
    """Save the recording, then log it."""
    probing = state.sitting.probing
    assert probing.open is not None, "a probe is measured after it was played"
    saved, mass_kg, rms = None, None, None
    if recording is None:
        trouble = trouble or "too little of it was kept"
    else:
        mass_kg, trouble = _mass_kg(recording, trouble)
        name = probe_name(probing.open.number)
        saved = save_trial_recording(sitting.folder, name, recording, _conditions(probing.open, sitting))
        mean_square = float(np.mean(np.sum(recording.response.samples**2, axis=1)))
        rms = math.sqrt(mean_square) if math.isfinite(mean_square) else None
    if trouble:
        sitting.display.trouble(f"A probe is not used: {trouble}.")
    event = ProbeMeasured(
        utc=sitting.clock.utc(),
        number=probing.open.number,
        vibrated_s=seconds,
        recording=saved.name if saved else None,
        sha256=saved.sha256 if saved else None,
        rms_mps2=rms,
        apparent_mass_kg=mass_kg,
        trouble=trouble,
    )
    return _Measured(
        log_and_apply(state, event, sitting), None, PlaybackResult(recording, sitting.device.health()), mass_kg
    )


def _mass_kg(recording: Recording, trouble: str) -> tuple[float | None, str]:
    """Apparent mass of the handle, None where it cannot be estimated; and any trouble, in words."""
    # Imported here: most sessions have no probes and begin sooner without it.
    from analysis.device_change.probe_lines import apparent_mass_kg, probe_lines

    try:
        return apparent_mass_kg(probe_lines(recording, PERIOD_S)), trouble
    except ValueError as problem:
        return None, str(problem)


def _conditions(probe: ProbePlayed, sitting: Sitting) -> dict[str, Any]:
    return {
        "session": sitting.folder.name,
        "probe": {"number": probe.number, "kind": probe.kind, "period_s": PERIOD_S},
        "level_n": probe.level_n,
        "hand": "held" if probe.kind == "hand" else "none",
        "provenance": {"versions": list_versions()},
    }


def _after_probe(
    state: SessionState, reply: Unanswered | None, play_result: PlaybackResult, sitting: Sitting
) -> AfterTrial:
    """A probe ends a sitting only where a trial would too: on request, or when the device is lost."""
    fault = play_result.health.fault
    if end_reason := reason_to_leave(fault):
        return AfterTrial(state, end_reason=end_reason, fault=fault)
    resolved = sitting.supervisor.resolve(reply or Unanswered("", ends_sitting=False, repeat_requested=True))
    outcome = early_end_result(state, resolved) if isinstance(resolved, Unanswered) else AfterTrial(state)
    return replace(outcome, void="", fault=fault)
