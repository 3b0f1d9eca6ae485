"""A probe between two trials, and the reference without a hand: logged, played, kept. Neither ever voids a trial."""

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from equalizer.signals.recording import Recording
from protocols.definition.probes import PERIOD_S
from study.devices.device import Fault, Played
from study.session.facts.events import ProbeMeasured, ProbePlayed
from study.session.state.probe_state import Probe
from study.session.state.state import SessionState
from study.session.stimulus.probe_stimulus import HELD_S, probe_stimulus, reference_commands
from study.session.views.form_views import FormKind
from study.session.views.forms import form_of, judge_form, take_the_handle, words_of
from study.session.views.views import PlayingNotice, Unanswered
from study.store.disk.provenance import versions
from study.store.sessions.trial_recordings import probe_name, save_trial_recording
from study.workflows.trial.after_trial import AfterTrial, check_end_request, cut_short, reason_to_leave
from study.workflows.trial.present_trial import await_handle
from study.workflows.trial.sitting import Sitting, notify_experimenter, record, release_device

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
    played: Played
    mass_kg: float | None
    """Apparent mass of the handle; None without a recording."""


def play_probe(state: SessionState, probe: Probe, sitting: Sitting) -> AfterTrial:
    """Play a probe with the hand on the handle, after waiting for the hand as a trial does."""
    hindrance = await_handle(state, sitting)
    if hindrance is not None:
        return cut_short(state, hindrance)
    if (ended := check_end_request(state, sitting)) is not None:
        return ended
    measured = _play_and_measure(state, "hand", probe.level_n, sitting)
    return _after_probe(measured.state, measured.reply, measured.played, sitting)


def play_reference(state: SessionState, sitting: Sitting) -> AfterTrial:
    """Ask for a free handle, test with a probe whether it is, and only then play the reference."""
    form = form_of(state.protocol, FormKind.HANDLE)
    assert form is not None, "a reference is due only where the protocol has one"
    held_kg = state.sitting.probing.hand_mass_kg
    if held_kg is None:
        return AfterTrial(_decline(state, "what the handle weighs in the hand could not be measured", sitting))
    sitting.supervisor.begin("form")
    if not judge_form(state.protocol, form, sitting.display.fill_in(form)).passed:
        return AfterTrial(_decline(state, "the handle was not free", sitting))
    if (ended := check_end_request(state, sitting)) is not None:
        return ended
    sitting.device.simulate_hand(False)
    after = _test_and_play(state, held_kg, sitting)
    if after.leave:
        return after
    sitting.device.simulate_hand(True)
    if not after.pause:
        sitting.supervisor.begin("form")
        sitting.display.fill_in(take_the_handle(words_of(state.protocol)))
    return after


def _test_and_play(state: SessionState, held_kg: float, sitting: Sitting) -> AfterTrial:
    # At the level of the probe that it is compared with: the influence of friction and springs depends on the level.
    test = _play_and_measure(state, "free", state.sitting.probing.hand_level_n, sitting)
    after = _after_probe(test.state, test.reply, test.played, sitting)
    if after.leave or after.pause or after.fault is not Fault.NONE:
        return after
    if test.mass_kg is None:
        return AfterTrial(_decline(test.state, "whether the handle is free could not be measured", sitting))
    if test.mass_kg > LIGHTER_WITHOUT_A_HAND * held_kg:
        why = f"the handle seems to be held: it answers like {test.mass_kg:.2f} kg, and {held_kg:.2f} kg in the hand"
        return AfterTrial(_decline(test.state, why, sitting))
    return _play_free(test.state, sitting)


def _decline(state: SessionState, why: str, sitting: Sitting) -> SessionState:
    notify_experimenter(f"No reference was played: {why}.", sitting)
    number = state.sitting.probing.played
    event = ProbeMeasured(utc=sitting.clock.utc(), number=number, vibrated_s=0.0, trouble=why)
    return record(state, event, sitting)


def _play_free(state: SessionState, sitting: Sitting) -> AfterTrial:
    probes, rate_hz = state.protocol.probes, sitting.device.info.sample_rate_hz
    commands, segments = reference_commands(probes, rate_hz)
    state = _log_played(state, "reference", probes.reference_n, sitting)
    sitting.supervisor.begin("reference")
    sitting.display.trouble(f"Hands off: the reference plays for {commands.duration_s:.0f} s.")

    def attend(share: float) -> None:
        if not sitting.supervisor.glance():
            raise _EndedEarlyError

    try:
        played = sitting.device.play(commands, attend)
    except _EndedEarlyError:
        fault = sitting.device.fault()
        state = _log_measured(state, None, 0.0, "it was cut short", sitting).state
        reply = sitting.supervisor.resolve(Unanswered("the reference was cut short", leave=False, asked=True))
        after = cut_short(state, reply) if isinstance(reply, Unanswered) else AfterTrial(state)
        return replace(after, leave=after.leave or reason_to_leave(fault), fault=fault)
    kept = None if played.recording is None else replace(played.recording, segments=segments)
    trouble = "" if kept is not None else played.health.fault.value
    state = _log_measured(state, kept, commands.duration_s, trouble, sitting).state
    return AfterTrial(state, leave=reason_to_leave(played.health.fault), fault=played.health.fault)


def _play_and_measure(state: SessionState, kind: Kind, level_n: float, sitting: Sitting) -> _Measured:
    """Log, play through the same port and under the same signs of life as a demonstration, and keep the recording."""
    stimulus = probe_stimulus(state.protocol.probes, level_n, sitting.device.info.sample_rate_hz)
    state = _log_played(state, kind, level_n, sitting)
    sitting.supervisor.begin("probe")
    sitting.device.hold(stimulus)
    notice = PlayingNotice(NO_QUESTION, 0, HELD_S, picture=None)
    reply = sitting.display.show_playing(notice, sitting.supervisor.glance)
    played = release_device(sitting)
    missed = played.health.missed_ticks
    trouble = played.health.fault.value if played.health.fault is not Fault.NONE else ""
    if not trouble and missed > state.protocol.measurement.missed_ticks_limit * max(played.health.ticks, 1):
        trouble = f"{missed} ticks of it were missed"
    seconds = played.health.ticks / sitting.device.info.sample_rate_hz
    ended = _log_measured(state, None if trouble else played.recording, seconds, trouble, sitting)
    return replace(ended, reply=reply, played=played)


def _log_played(state: SessionState, kind: Kind, level_n: float, sitting: Sitting) -> SessionState:
    number = state.sitting.probing.played
    return record(state, ProbePlayed(sitting.clock.utc(), number, kind, level_n), sitting)


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
    return _Measured(record(state, event, sitting), None, Played(recording, sitting.device.health()), mass_kg)


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
        "provenance": {"versions": versions()},
    }


def _after_probe(state: SessionState, reply: Unanswered | None, played: Played, sitting: Sitting) -> AfterTrial:
    """A probe ends a sitting only where a trial would too: on request, or when the device is lost."""
    fault = played.health.fault
    if leave := reason_to_leave(fault):
        return AfterTrial(state, leave=leave, fault=fault)
    resolved = sitting.supervisor.resolve(reply or Unanswered("", leave=False, asked=True))
    after = cut_short(state, resolved) if isinstance(resolved, Unanswered) else AfterTrial(state)
    return replace(after, void="", fault=fault)
