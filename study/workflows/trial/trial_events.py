"""Make the events of a trial for the session log (presented, measured, void), and save its recording.

Units: levels in N, accelerations in m/s², times in s; displacement and offset in mm.
"""

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from equalizer.signals.signal import FloatArray
from protocols.trial import VoidCause
from study.devices.device import Fault, Health, PlaybackResult
from study.session.facts.answer_given import AnswerHealth
from study.session.facts.events import TrialMeasured, TrialPresented, TrialSpoiled
from study.session.state.due_trial import PresentTrial
from study.session.state.state import SessionState
from study.session.stimulus.delivered import DeliveredMotion
from study.store.disk.provenance import list_versions
from study.store.sessions.trial_recordings import name_recording, save_trial_recording
from study.workflows.trial.sitting import Sitting

LOGGED_COUNTERS = tuple(field.name for field in fields(AnswerHealth) if field.name not in ("fault", "felt_whole"))
"""Counters of the device that are logged with an answer, by the same names in `Health` and `AnswerHealth`."""


@dataclass(frozen=True, slots=True, eq=False)
class TrialOutcome:
    """Result of an answered trial that counts: what the device played and what was measured."""

    play_result: PlaybackResult
    """Recording of the stimulus, and counters of the device."""
    delivered: DeliveredMotion | None
    """Delivered amplitudes; None without a recording, where less than a period was measured, or where the acceleration
    cannot be trusted."""
    flags: tuple[str, ...]
    """Reasons, in words, why the stimulus should be inspected; empty without any."""
    unit_vector: FloatArray
    """(3,), unit vector of the direction played, in device coordinates."""
    acceleration_trusted: bool
    """Whether the acceleration of the recording can be trusted."""


def make_presented_event(due_trial: PresentTrial, sitting: Sitting) -> TrialPresented:
    """Make the event of a trial that is presented, to be logged before the stimulus is played."""
    return TrialPresented(
        utc=sitting.clock.utc(),
        run=due_trial.run,
        trial=due_trial.trial,
        attempt=due_trial.attempt,
        phase=due_trial.phase,
        frequency_hz=due_trial.frequency_hz,
        level_db=due_trial.level_db,
        level_n=due_trial.level_n,
        direction=1 if due_trial.label == 1 else 2,
        angle_deg=due_trial.angle_deg,
        polarity=1 if due_trial.polarity > 0 else -1,
        wanted_mps2=due_trial.wanted_mps2,
        nominal_n=due_trial.nominal_n,
    )


def make_answer_health(health: Health, is_complete: bool) -> AnswerHealth:
    """Make the counters of the device that are logged with the answer. is_complete: whether the device had no fault
    until the answer."""
    counters: dict[str, Any] = {name: getattr(health, name) for name in LOGGED_COUNTERS}
    return AnswerHealth(fault=health.fault.name, felt_whole=is_complete, **counters)


def restore_health(logged_health: AnswerHealth) -> Health:
    """Restore the counters of the device from the log. Those that are not logged (feedback, sensor, cause) have their
    defaults. An unknown name of a fault, as of a later version, becomes `Fault.NOT_A_NUMBER`."""
    counters: dict[str, Any] = {name: getattr(logged_health, name) or 0 for name in LOGGED_COUNTERS}
    return Health(fault=Fault.__members__.get(logged_health.fault, Fault.NOT_A_NUMBER), **counters)


def make_void_event(
    due_trial: PresentTrial, reason_and_cause: tuple[str, VoidCause], health: Health | None, sitting: Sitting
) -> TrialSpoiled:
    """Make the event of a void trial. reason_and_cause: the reason in words, and its cause. health: counters of the
    device; None if nothing was played."""
    reason, cause = reason_and_cause
    return TrialSpoiled(
        utc=sitting.clock.utc(),
        run=due_trial.run,
        trial=due_trial.trial,
        attempt=due_trial.attempt,
        reason=reason,
        missed_ticks=health.missed_ticks if health else None,
        late_ticks=health.late_ticks if health else None,
        latest_s=health.latest_s if health else None,
        vibrated_s=_compute_vibration_s(health, sitting) if health else 0.0,
        cause=cause,
        sensor=health.sensor if health else None,
    )


def record_measured_trial(
    due_trial: PresentTrial, outcome: TrialOutcome, state: SessionState, sitting: Sitting
) -> TrialMeasured:
    """Save the recording of a trial that counts, if there is one, and make its event with the name and SHA-256 of the
    recording. Raises StudyError where the recording cannot be written."""
    saved_recording = None
    if outcome.play_result.recording is not None:
        metadata = _make_recording_metadata(due_trial, outcome, state, sitting)
        name = name_recording(due_trial.run, due_trial.trial, due_trial.attempt)
        saved_recording = save_trial_recording(sitting.folder, name, outcome.play_result.recording, metadata)
    delivered = outcome.delivered
    return TrialMeasured(
        utc=sitting.clock.utc(),
        run=due_trial.run,
        trial=due_trial.trial,
        attempt=due_trial.attempt,
        # After a quick answer, before the steady part of the stimulus, nothing can be measured; this is no fault.
        status="flagged" if outcome.flags else "unmeasured" if delivered is None else "ok",
        flags=outcome.flags,
        recording=saved_recording.name if saved_recording else None,
        sha256=saved_recording.sha256 if saved_recording else None,
        delivered_mps2=delivered.along_mps2 if delivered else None,
        off_axis_mps2=delivered.off_axis_mps2 if delivered else None,
        displacement_mm=delivered.displacement_mm if delivered else None,
        harmonics_mps2=delivered.harmonics_mps2 if delivered else None,
        missed_ticks=outcome.play_result.health.missed_ticks,
        late_ticks=outcome.play_result.health.late_ticks,
        latest_s=outcome.play_result.health.latest_s,
        vibrated_s=_compute_vibration_s(outcome.play_result.health, sitting),
        offset_mm=_compute_largest_offset_mm(outcome.play_result, sitting),
        sensor=outcome.play_result.health.sensor,
    )


def _compute_vibration_s(health: Health, sitting: Sitting) -> float:
    """Compute the duration of the vibration (s), fades and missed ticks included, for the vibration dose."""
    return health.ticks / sitting.device.info.sample_rate_hz


def _compute_largest_offset_mm(play_result: PlaybackResult, sitting: Sitting) -> float | None:
    """Compute the largest distance of the handle from the place where trials start during the recording (mm); None
    without finite positions."""
    if play_result.recording is None or play_result.recording.position is None:
        return None
    distance_m = np.linalg.norm(play_result.recording.position.samples - np.asarray(sitting.place_m), axis=1)
    return 1000.0 * float(np.nanmax(distance_m)) if np.isfinite(distance_m).any() else None


def _make_recording_metadata(
    due_trial: PresentTrial, outcome: TrialOutcome, state: SessionState, sitting: Sitting
) -> dict[str, Any]:
    """Make the metadata of the recording file, as JSON values: what was played, counters of the device, provenance."""
    return {
        "session": sitting.folder.name,
        "trial": {"run": due_trial.run, "trial": due_trial.trial, "attempt": due_trial.attempt},
        "frequency_hz": due_trial.frequency_hz,
        "level_n": due_trial.level_n,
        "wanted_mps2": due_trial.wanted_mps2,
        "unit_vector": [float(component) for component in outcome.unit_vector],
        "hand": "held",
        "missed_ticks": outcome.play_result.health.missed_ticks,
        "late_ticks": outcome.play_result.health.late_ticks,
        "latest_s": outcome.play_result.health.latest_s,
        "flags": list(outcome.flags),
        "acceleration_trusted": outcome.acceleration_trusted,
        "sensor": None if outcome.play_result.health.sensor is None else asdict(outcome.play_result.health.sensor),
        "equalizer": sitting.equalizer.name,
        "provenance": {
            "protocol_hash": state.opened.protocol_hash,
            "seed": state.opened.seed,
            "versions": list_versions(),
        },
    }
