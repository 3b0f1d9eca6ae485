"""Concatenate the trials of a session to a single recording for a diagnosis, sorted by frequency and class of levels.

The recording of a trial begins in the middle of a vibration, whereas a simulation starts from rest. Therefore a lead-in
precedes each trial: the trial's command, continued periodically and faded in, with an unknown response (NaN).

The command is the planned excitation where it was recorded. The virtual spring that held the handle then becomes part
of the model, because a simulation that is driven by the recorded force of the spring would drift. Positions are left
out: the encoders are on the motors' side of the cables, and the position at which a handle with friction comes to rest
is random.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from study.errors import StudyError
from study.session.facts.events import TrialMeasured
from study.store.disk.provenance import compute_sha256
from study.store.formats.recording_file import read_recording
from study.store.sessions.archive import SessionFolder, find_session
from study.store.sessions.trial_recordings import PROBE_PREFIX
from study.workflows.results.fold_session import fold_session

LONGEST_TOTAL_S = 60.0
"""Approximate limit of the total duration of the trials (s). Chosen: more would cost time and add little
information."""
LEAD_S = 0.4
"""Duration of the lead-in before each trial (s). Chosen: a handle that is held by a hand settles in less time."""
COMMON_PERIOD_S = 0.2
"""Period (s) of a segment of the joined recording where it is a multiple of the trial's own period (`_choose_period`).
Chosen, so that more of the signal is compared."""
LEVEL_CLASS_DB = 4.0
"""Width (dB) of a class of levels, chosen: a staircase has too many levels to compare individually."""
TRIALS_PER_TEST_TRIAL = 4
"""Of each frequency and class of levels, one trial in this many is held out for the test (rounded down); chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class JoinedTrials:
    """Trials of a session, concatenated to a recording, and what the diagnosis must know about the session."""

    recording: Recording
    name: str
    """Name of the session's folder."""
    parents: tuple[Path, ...]
    """Files that were read: the event log, then the recordings of the trials used."""
    remarks: tuple[str, ...]
    """Sentences on which trials were used, left out and held out for the test."""
    simulated: bool
    """Whether the device was the simulated omega.3."""
    spring_n_per_m: float
    """Stiffness of the virtual spring (N/m), whose force is not in the recording's command; 0 = none, or not known."""


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """A usable trial, with frequency (Hz) and level (N) as stated in its recording."""

    path: Path
    recording: Recording
    frequency_hz: float
    level_n: float


def join_session_trials(session: Path, seed: int) -> JoinedTrials:
    """Read the trials of a session and concatenate them. session: its folder. seed: of the random choice of trials if
    there are too many, and of those held out for the test. Raises StudyError, also if no trial is usable."""
    session_folder = find_session(str(session), session.absolute().parent)
    folded_session = fold_session(session_folder)
    session_opened = folded_session.state.opened
    logged_hashes = {
        event.recording: event.sha256
        for event in folded_session.log_contents.events
        if isinstance(event, TrialMeasured) and event.recording
    }
    paths = [path for path in sorted(session_folder.recordings.glob("*.h5")) if not path.name.startswith(PROBE_PREFIX)]
    read_trials = [_read_trial(path, logged_hashes) for path in paths]
    usable_trials = [trial for trial in read_trials if trial is not None]
    if not usable_trials:
        raise StudyError(
            "This session holds nothing to diagnose",
            f"{session_folder.name} has {len(read_trials)} recordings of trials, and none can be used.",
            "Give a session in which trials were measured, or recordings of `hapteq record`.",
            saved="Nothing was written.",
        )
    generator = np.random.default_rng(seed)
    drawn_trials = _draw_trials(usable_trials, generator)
    stiffness_n_per_m = estimate_spring_stiffness([trial.recording for trial in drawn_trials])
    return JoinedTrials(
        recording=_concatenate_trials(drawn_trials, session_folder, generator),
        name=session_folder.name,
        parents=(session_folder.log, *(trial.path for trial in drawn_trials)),
        remarks=tuple(_write_remarks(session_folder, read_trials, usable_trials, drawn_trials)),
        simulated=session_opened.device.simulated,
        spring_n_per_m=stiffness_n_per_m,
    )


def _read_trial(path: Path, logged_hashes: Mapping[str, str | None]) -> _Trial | None:
    """Read a trial; None if samples are missing, if the recording has flags of a problem, if frequency, level or
    segments are not stated, or if the file's hash differs from the log. logged_hashes: SHA-256 by the file's path below
    the session's folder, None where the log has none (the trial is then left out)."""
    logged_name = f"{path.parent.name}/{path.name}"
    if logged_name in logged_hashes and compute_sha256(path) != logged_hashes[logged_name]:
        return None
    recording = read_recording(path)
    meta = recording.meta
    is_complete = np.isfinite(recording.command.samples).all() and np.isfinite(recording.response.samples).all()
    if not is_complete or meta.get("flags") or not isinstance(meta.get("frequency_hz"), int | float):
        return None
    if not recording.segments or not isinstance(meta.get("level_n"), int | float):
        return None
    return _Trial(path, recording, float(meta["frequency_hz"]), float(meta["level_n"]))


def _draw_trials(trials: Sequence[_Trial], generator: np.random.Generator) -> list[_Trial]:
    """Draw a random sample of about `LONGEST_TOTAL_S`, stratified by frequency and class of levels: at least one trial
    of each group. Sorted by group (`_make_group_key`); all trials if they are short enough."""
    total_s = sum(trial.recording.response.duration_s for trial in trials)
    drawn_share = min(1.0, LONGEST_TOTAL_S / total_s)
    drawn_trials: list[_Trial] = []
    for _, group_members in groupby(sorted(trials, key=_make_group_key), key=_make_group_key):
        group_trials = list(group_members)
        drawn_count = max(1, round(drawn_share * len(group_trials)))
        drawn_trials += [
            group_trials[index] for index in sorted(generator.permutation(len(group_trials))[:drawn_count])
        ]
    return drawn_trials


def _make_group_key(trial: _Trial) -> tuple[float, int]:
    """Make the key by which trials are grouped: frequency (Hz) and class of levels."""
    return trial.frequency_hz, _compute_level_class(trial.level_n)


def _compute_level_class(level_n: float) -> int:
    """Compute the class of a level (N): the level in dB relative to 1 N, in steps of `LEVEL_CLASS_DB`, rounded. Levels
    below 1e-6 N, also 0, count as 1e-6 N."""
    return round(20 * math.log10(max(level_n, 1e-6)) / LEVEL_CLASS_DB)


def _concatenate_trials(trials: Sequence[_Trial], folder: SessionFolder, generator: np.random.Generator) -> Recording:
    """Concatenate the trials, each with its lead-in, to a recording with a segment for each trial, whose amplitude is
    the middle of its class of levels (N). trials: sorted by `_make_group_key`. generator: chooses the trials that are
    held out for the test."""
    first_recording = trials[0].recording
    lead_samples = round(LEAD_S * first_recording.sample_rate_hz)
    trial_signals: list[Mapping[str, FloatArray]] = []
    segments: list[Segment] = []
    trial_start = 0
    for (_, level_class), group_members in groupby(trials, key=_make_group_key):
        group_trials = list(group_members)
        test_indices = set(
            generator.permutation(len(group_trials))[: len(group_trials) // TRIALS_PER_TEST_TRIAL].tolist()
        )
        for index, trial in enumerate(group_trials):
            trial_signals.append(_prepend_lead(trial.recording, lead_samples))
            segment = trial.recording.segments[0]
            start, stop = trial_start + lead_samples + segment.start, trial_start + lead_samples + segment.stop
            role = "test" if index in test_indices else "fit"
            period = _choose_period(segment.period, trial.recording.sample_rate_hz)
            segments.append(Segment(start, stop, "sine", 10 ** (level_class * LEVEL_CLASS_DB / 20), period, role))
            trial_start += lead_samples + len(trial.recording)
    command = _concatenate_signal("command", trial_signals, _select_planned_command(first_recording))
    return Recording(
        device=first_recording.device,
        command=command,
        response=_concatenate_signal("response", trial_signals, first_recording.response),
        excitation=command,
        hold=first_recording.hold,
        segments=tuple(segments),
        meta={"session": folder.name, "hand": "held"},
    )


def _select_planned_command(recording: Recording) -> Signal:
    """Select the command without the feedback of the virtual spring: the excitation if it was recorded, otherwise the
    recorded command."""
    return recording.command if recording.excitation is None else recording.excitation


def _choose_period(period: int, sample_rate_hz: float) -> int:
    """Choose the period of a segment in samples: `COMMON_PERIOD_S` if that is a multiple of the trial's period,
    otherwise the trial's period. period: of the trial, in samples; 0 = not periodic."""
    common_period_samples = round(COMMON_PERIOD_S * sample_rate_hz)
    return common_period_samples if period > 0 and common_period_samples % period == 0 else period


def _prepend_lead(recording: Recording, lead_samples: int) -> dict[str, FloatArray]:
    """Prepend the lead-in to command and response, each (lead_samples + n, channels). In the lead-in the command is
    continued periodically and faded in linearly over the first half; the response is NaN."""
    command, response = _select_planned_command(recording).samples, recording.response.samples
    period = recording.segments[0].period or len(recording)
    fade = np.minimum(1.0, np.arange(lead_samples) / max(1, lead_samples // 2))[:, None]
    lead_command = fade * command[np.arange(-lead_samples, 0) % min(period, len(command))]
    return {
        "command": np.vstack([lead_command, command]),
        "response": np.vstack([np.full((lead_samples, response.shape[1]), np.nan), response]),
    }


def estimate_spring_stiffness(recordings: Sequence[Recording]) -> float:
    """Estimate the stiffness k (N/m) of the virtual spring by least squares from command - excitation = -k position,
    over all channels. 0 if a recording has no excitation, no position or another number of position channels than of
    commands, if a position is not finite, or if all are 0."""
    force_times_position, squared_position = 0.0, 0.0
    for recording in recordings:
        if recording.excitation is None or recording.position is None:
            return 0.0
        positions_m = recording.position.samples
        if positions_m.shape != recording.command.samples.shape or not np.isfinite(positions_m).all():
            return 0.0
        force_times_position -= float(np.sum((recording.command.samples - recording.excitation.samples) * positions_m))
        squared_position += float(np.sum(positions_m**2))
    return force_times_position / squared_position if squared_position > 0 else 0.0


def _concatenate_signal(
    name: str, trial_signals: Sequence[Mapping[str, FloatArray]], template_signal: Signal
) -> Signal:
    """Concatenate the signal `name` of all trials, with rate, channels and units of `template_signal`."""
    return replace(template_signal, samples=np.vstack([signals[name] for signals in trial_signals]))


def _write_remarks(
    folder: SessionFolder, trials: Sequence[Any], usable_trials: Sequence[_Trial], drawn_trials: Sequence[_Trial]
) -> Iterator[str]:
    """Write sentences on the trials that were used, left out and held out. trials: all, with None for an unusable
    trial."""
    total_s = sum(trial.recording.response.duration_s for trial in drawn_trials)
    yield (
        f"{len(drawn_trials)} of the {len(trials)} trials of {folder.name} were used, {total_s:.0f} s in all, with a "
        "hand on the handle: they contain single frequencies at the levels of the staircases, and no slow or strong "
        "motion and no other frequencies. Effects that show only there cannot be found here."
    )
    if len(usable_trials) < len(trials):
        yield (
            f"{len(trials) - len(usable_trials)} trials were left out: samples were missing, something was wrong while "
            "they were played, or the file was changed since."
        )
    yield (
        f"Levels are grouped in classes {LEVEL_CLASS_DB:g} dB wide. Of each frequency and class, one trial in "
        f"{TRIALS_PER_TEST_TRIAL} is kept for the test."
    )
