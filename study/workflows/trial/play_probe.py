"""Play and log a probe between two trials, and the reference recorded without a hand.

Probes are short excitations from which drifts of device and hand are estimated. A failed probe or reference never makes
a trial void.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from equalizer.signals.recording import Recording
from protocols.definition.probes import PERIOD_S, PROBE_HOLD_S
from study.devices.device import Fault, PlaybackResult
from study.session.facts.events import ProbeMeasured, ProbePlayed
from study.session.state.probe_state import Probe
from study.session.state.state import SessionState
from study.session.stimulus.delivered import MAX_AMPLITUDE_MPS2
from study.session.stimulus.probe_stimulus import make_probe_stimulus, make_reference_commands
from study.session.views.form_views import FormKind
from study.session.views.forms import judge_form, make_form, make_take_handle_form, make_words
from study.session.views.participant_views import PlayingNotice, Unanswered
from study.store.disk.provenance import list_versions
from study.store.sessions.trial_recordings import name_probe_recording, save_trial_recording
from study.workflows.trial.action_result import (
    ActionResult,
    check_end_request,
    find_fault_end_reason,
    make_early_end_result,
)
from study.workflows.trial.present_trial import await_handle
from study.workflows.trial.sitting import Sitting, log_and_apply, notify_experimenter, release_device

MAX_FREE_MASS_RATIO = 0.9
"""Largest ratio of the apparent mass of the handle without the hand to that with the hand at which the handle counts as
free. Chosen."""

NO_QUESTION = "Nothing to answer: the device is measured"
"""Text shown while a probe plays."""

ProbeKind = Literal["hand", "free", "reference"]
"""Probe with the hand on the handle; probe that tests whether the handle is free; reference without a hand."""


class _EndedEarlyError(Exception):
    """A stop request, a pause request or a fault during the reference; raised in its progress callback to end the
    playback."""


@dataclass(frozen=True, slots=True)
class _MeasuredProbe:
    """A probe or reference that was played and logged."""

    state: SessionState
    reply: Unanswered | None
    """Why the playback ended early; None where it was complete."""
    play_result: PlaybackResult
    mass_kg: float | None
    """Apparent mass of the handle; None where it cannot be estimated, such as without a recording."""


def play_probe(state: SessionState, probe: Probe, sitting: Sitting) -> ActionResult:
    """Wait for the handle as before a trial, then play, measure and log a probe with the hand on the handle."""
    early_reply = await_handle(state, sitting)
    if early_reply is not None:
        return make_early_end_result(state, early_reply)
    if (early_end := check_end_request(state, sitting)) is not None:
        return early_end
    measured_probe = _play_and_measure(state, "hand", probe.level_n, sitting)
    return _conclude_probe(measured_probe.state, measured_probe.reply, measured_probe.play_result, sitting)


def play_reference(state: SessionState, sitting: Sitting) -> ActionResult:
    """Ask for a free handle, test with a probe whether it is free, and only then play the reference; afterwards ask the
    participant to take the handle, unless the sitting pauses or ends. If the reference is not played, the reason is
    logged, except where a request, or an early end or fault of the probe, prevents it."""
    form = make_form(state.protocol, FormKind.HANDLE)
    assert form is not None, "a reference is due only where the protocol has one"
    hand_mass_kg = state.sitting.probing.hand_mass_kg
    if hand_mass_kg is None:
        return ActionResult(_skip_reference(state, "what the handle weighs in the hand could not be measured", sitting))
    sitting.supervisor.start_activity("form")
    if not judge_form(state.protocol, form, sitting.display.fill_in(form)).passed:
        return ActionResult(_skip_reference(state, "the handle was not free", sitting))
    if (early_end := check_end_request(state, sitting)) is not None:
        return early_end
    sitting.device.simulate_hand(False)
    outcome = _test_and_play_reference(state, hand_mass_kg, sitting)
    if outcome.end_reason:
        return outcome
    sitting.device.simulate_hand(True)
    if not outcome.pause:
        sitting.supervisor.start_activity("form")
        sitting.display.fill_in(make_take_handle_form(make_words(state.protocol)))
    return outcome


def _test_and_play_reference(state: SessionState, hand_mass_kg: float, sitting: Sitting) -> ActionResult:
    """Play a probe without the hand; play the reference if the apparent mass is at most `MAX_FREE_MASS_RATIO` times
    `hand_mass_kg`, the apparent mass (kg) with the hand."""
    # At the level of the probe with the hand: the influence of friction and springs depends on the level.
    free_probe = _play_and_measure(state, "free", state.sitting.probing.hand_level_n, sitting)
    outcome = _conclude_probe(free_probe.state, free_probe.reply, free_probe.play_result, sitting)
    if outcome.end_reason or outcome.pause or outcome.fault is not Fault.NONE:
        return outcome
    if free_probe.mass_kg is None:
        return ActionResult(
            _skip_reference(free_probe.state, "whether the handle is free could not be measured", sitting)
        )
    if free_probe.mass_kg > MAX_FREE_MASS_RATIO * hand_mass_kg:
        reason = (
            f"the handle seems to be held: its apparent mass is {free_probe.mass_kg:.2f} kg, and {hand_mass_kg:.2f} kg "
            "in the hand"
        )
        return ActionResult(_skip_reference(free_probe.state, reason, sitting))
    return _play_reference_commands(free_probe.state, sitting)


def _skip_reference(state: SessionState, reason: str, sitting: Sitting) -> SessionState:
    """Report to the experimenter and log that no reference is played, and why. reason: a clause."""
    notify_experimenter(f"No reference was played: {reason}.", sitting)
    number = state.sitting.probing.probe_count
    event = ProbeMeasured(utc=sitting.clock.utc(), number=number, vibrated_s=0.0, trouble=reason)
    return log_and_apply(state, event, sitting)


def _play_reference_commands(state: SessionState, sitting: Sitting) -> ActionResult:
    """Play the reference, measure and log it. A stop request, a pause request or a fault ends it early."""
    probes, rate_hz = state.protocol.probes, sitting.device.info.sample_rate_hz
    commands, segments = make_reference_commands(probes, rate_hz)
    state = _log_probe_start(state, "reference", probes.reference_n, sitting)
    sitting.supervisor.start_activity("reference")
    sitting.display.trouble(f"Hands off: the reference plays for {commands.duration_s:.0f} s.")

    played_share = 0.0

    def keep_alive(share: float) -> None:
        """Progress callback: note the played share, and keep the device alive, or end the playback."""
        nonlocal played_share
        played_share = share
        if not sitting.supervisor.keep_alive():
            raise _EndedEarlyError

    try:
        play_result = sitting.device.play(commands, keep_alive)
    except _EndedEarlyError:
        fault = sitting.device.fault()
        played_s = played_share * commands.duration_s
        state = _save_and_log_measurement(state, None, played_s, "it was cut short", sitting).state
        reply = sitting.supervisor.resolve(
            Unanswered("the reference was cut short", ends_sitting=False, repeat_requested=True)
        )
        outcome = make_early_end_result(state, reply) if isinstance(reply, Unanswered) else ActionResult(state)
        return replace(outcome, end_reason=outcome.end_reason or find_fault_end_reason(fault), fault=fault)
    recording = None if play_result.recording is None else replace(play_result.recording, segments=segments)
    trouble = "" if recording is not None else play_result.health.fault.value
    state = _save_and_log_measurement(state, recording, commands.duration_s, trouble, sitting).state
    return ActionResult(
        state, end_reason=find_fault_end_reason(play_result.health.fault), fault=play_result.health.fault
    )


def _play_and_measure(state: SessionState, kind: ProbeKind, level_n: float, sitting: Sitting) -> _MeasuredProbe:
    """Play a probe, save its recording, and log it. The probe is not used after a fault, or with more missed ticks than
    a trial may have. level_n: peak force (N)."""
    stimulus = make_probe_stimulus(state.protocol.probes, level_n, sitting.device.info.sample_rate_hz)
    state = _log_probe_start(state, kind, level_n, sitting)
    sitting.supervisor.start_activity("probe")
    sitting.device.hold(stimulus)
    notice = PlayingNotice(NO_QUESTION, 0, PROBE_HOLD_S, picture=None)
    reply = sitting.display.show_playing(notice, sitting.supervisor.keep_alive)
    play_result = release_device(sitting)
    missed_ticks = play_result.health.missed_ticks
    trouble = play_result.health.fault.value if play_result.health.fault is not Fault.NONE else ""
    if not trouble and missed_ticks > state.protocol.measurement.missed_ticks_limit * max(play_result.health.ticks, 1):
        trouble = f"{missed_ticks} ticks of it were missed"
    duration_s = play_result.health.ticks / sitting.device.info.sample_rate_hz
    measured_probe = _save_and_log_measurement(
        state, None if trouble else play_result.recording, duration_s, trouble, sitting
    )
    return replace(measured_probe, reply=reply, play_result=play_result)


def _log_probe_start(state: SessionState, kind: ProbeKind, level_n: float, sitting: Sitting) -> SessionState:
    """Log the start of a probe or reference of this peak force (N)."""
    number = state.sitting.probing.probe_count
    return log_and_apply(state, ProbePlayed(sitting.clock.utc(), number, kind, level_n), sitting)


def _save_and_log_measurement(
    state: SessionState, recording: Recording | None, duration_s: float, trouble: str, sitting: Sitting
) -> _MeasuredProbe:
    """Save the recording, if there is one, and log duration, rms acceleration (m/s²) and apparent mass (kg). trouble:
    why the probe is not used, empty if no reason is known yet."""
    probing = state.sitting.probing
    assert probing.open is not None, "a probe is measured after it was played"
    saved_file, mass_kg, rms_mps2 = None, None, None
    if recording is None:
        trouble = trouble or "too little of it was kept"
    else:
        mass_kg, trouble = _estimate_mass_kg(recording, trouble)
        file_name = name_probe_recording(probing.open.number)
        saved_file = save_trial_recording(
            sitting.folder, file_name, recording, _make_recording_metadata(probing.open, sitting)
        )
        mean_square = float(np.mean(np.sum(recording.response.samples**2, axis=1)))
        rms_mps2 = math.sqrt(mean_square) if mean_square <= MAX_AMPLITUDE_MPS2**2 else None
    if trouble:
        sitting.display.trouble(f"A probe is not used: {trouble}.")
    event = ProbeMeasured(
        utc=sitting.clock.utc(),
        number=probing.open.number,
        vibrated_s=duration_s,
        recording=saved_file.name if saved_file else None,
        sha256=saved_file.sha256 if saved_file else None,
        rms_mps2=rms_mps2,
        apparent_mass_kg=mass_kg,
        trouble=trouble,
    )
    return _MeasuredProbe(
        log_and_apply(state, event, sitting), None, PlaybackResult(recording, sitting.device.health()), mass_kg
    )


def _estimate_mass_kg(recording: Recording, trouble: str) -> tuple[float | None, str]:
    """Estimate the apparent mass (kg) of the handle; None where it cannot be estimated. Returns also why the probe is
    not used: `trouble`, or why there is no estimate."""
    # Imported here: most sessions have no probes and begin sooner without it.
    from analysis.device_change.probe_lines import compute_probe_lines, estimate_apparent_mass_kg

    try:
        return estimate_apparent_mass_kg(compute_probe_lines(recording, PERIOD_S)), trouble
    except ValueError as error:
        return None, str(error)


def _make_recording_metadata(probe: ProbePlayed, sitting: Sitting) -> dict[str, Any]:
    """Make the metadata of the recording of a probe: session, number and kind, peak force (N), hand, versions."""
    return {
        "session": sitting.folder.name,
        "probe": {"number": probe.number, "kind": probe.kind, "period_s": PERIOD_S},
        "level_n": probe.level_n,
        "hand": "held" if probe.kind == "hand" else "none",
        "provenance": {"versions": list_versions()},
    }


def _conclude_probe(
    state: SessionState, reply: Unanswered | None, play_result: PlaybackResult, sitting: Sitting
) -> ActionResult:
    """Make the result of a probe for the sitting. A probe ends the sitting only where a trial would, too: on request,
    or after a fault that requires to open the device again. reply: why the playback ended early; None where it was
    complete."""
    fault = play_result.health.fault
    if end_reason := find_fault_end_reason(fault):
        return ActionResult(state, end_reason=end_reason, fault=fault)
    resolved = sitting.supervisor.resolve(reply or Unanswered("", ends_sitting=False, repeat_requested=True))
    outcome = make_early_end_result(state, resolved) if isinstance(resolved, Unanswered) else ActionResult(state)
    return replace(outcome, void="", fault=fault)
