"""Joins the trials of a session to a single recording for a diagnosis, in the order of frequency and level.

The recording of a trial begins in the middle of a vibration, whereas a simulation starts from rest. So a lead is put
before each trial: its own command, repeated periodically and faded in, with an unknown response (NaN).

The command is the excitation, which was computed beforehand. The virtual spring that held the handle becomes part of
the model, because a simulation that is driven by the recorded force of the spring would drift. Positions are left out:
the encoders are on the motors' side of the cables, and the position at which a handle with friction comes to rest is
random.
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
from study.store.disk.provenance import sha256_of
from study.store.formats.recording_file import read_recording
from study.store.sessions.archive import SessionFolder, find_session
from study.store.sessions.trial_recordings import PROBE_PREFIX
from study.workflows.results.fold_session import fold_session

MOST_S = 60.0
"""Largest total duration of the trials (s), approximately: more would cost time and add little information."""
LEAD_S = 0.4
"""Duration of the lead before each trial (s): a handle that is held by a hand settles in less."""
REPEAT_S = 0.2
"""Length of a period (s) in the joined recording, where it is a whole number of cycles, so that more of the signal is
compared; otherwise a period is a cycle."""
LEVEL_STEP_DB = 4.0
"""Width (dB) of the classes of levels: a staircase has too many levels to compare individually."""
TESTED_OF = 4
"""A trial in this many of the same frequency and class of levels is kept for the test."""


@dataclass(frozen=True, slots=True, eq=False)
class SessionRecordings:
    """Trials of a session, joined to a recording, and what the diagnosis must know about the session."""

    recording: Recording
    name: str
    """Name of the session's folder."""
    parents: tuple[Path, ...]
    """Log and recordings that were read."""
    remarks: tuple[str, ...]
    """Sentences on which trials were used, left out and kept for the test."""
    simulated: bool
    """Whether the device was the simulated omega.3."""
    spring_n_per_m: float
    """Stiffness of the virtual spring (N/m), whose force is not in the recording's command; 0: none, or not known."""


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """A usable trial, with frequency (Hz) and level (N) as its recording states them."""

    path: Path
    recording: Recording
    frequency_hz: float
    level_n: float


def session_recordings(session: Path, seed: int) -> SessionRecordings:
    """Read the trials of a session. session: its folder. seed: of the draw of trials if there are too many, and of
    those kept for the test. Raises StudyError where no trial is complete."""
    folder = find_session(str(session), session.absolute().parent)
    folded_session = fold_session(folder)
    session_opened = folded_session.state.opened
    logged = {
        e.recording: e.sha256
        for e in folded_session.log_contents.events
        if isinstance(e, TrialMeasured) and e.recording
    }
    paths = [path for path in sorted(folder.recordings.glob("*.h5")) if not path.name.startswith(PROBE_PREFIX)]
    trials = [_trial(path, logged) for path in paths]
    usable = [trial for trial in trials if trial is not None]
    if not usable:
        raise StudyError(
            "This session holds nothing to diagnose",
            f"{folder.name} has {len(trials)} recordings of trials, and none is whole.",
            "Give a session in which trials were measured, or recordings of `hapteq record`.",
            saved="Nothing was written.",
        )
    draw = np.random.default_rng(seed)
    drawn_trials = _draw_trials(usable, draw)
    spring = estimate_spring([trial.recording for trial in drawn_trials])
    return SessionRecordings(
        recording=_concatenate_trials(drawn_trials, folder, draw),
        name=folder.name,
        parents=(folder.log, *(trial.path for trial in drawn_trials)),
        remarks=tuple(_remarks(folder, trials, usable, drawn_trials)),
        simulated=session_opened.device.simulated,
        spring_n_per_m=spring,
    )


def _trial(path: Path, logged: Mapping[str, str | None]) -> _Trial | None:
    """The trial; None if samples are missing, the recording carries flags of a problem, frequency, level or segments
    are not stated, or the file differs from the log. logged: SHA-256 by name."""
    name = f"{path.parent.name}/{path.name}"
    if name in logged and sha256_of(path) != logged[name]:
        return None
    recording = read_recording(path)
    meta = recording.meta
    is_complete = np.isfinite(recording.command.samples).all() and np.isfinite(recording.response.samples).all()
    if not is_complete or meta.get("flags") or not isinstance(meta.get("frequency_hz"), int | float):
        return None
    if not recording.segments or not isinstance(meta.get("level_n"), int | float):
        return None
    return _Trial(path, recording, float(meta["frequency_hz"]), float(meta["level_n"]))


def _draw_trials(trials: Sequence[_Trial], draw: np.random.Generator) -> list[_Trial]:
    """Random sample of about `MOST_S`, stratified by frequency and class of levels: at least one trial of each
    group."""
    seconds = sum(trial.recording.response.duration_s for trial in trials)
    share = min(1.0, MOST_S / seconds)
    drawn_trials: list[_Trial] = []
    for _, members in groupby(sorted(trials, key=_key), key=_key):
        group = list(members)
        count = max(1, round(share * len(group)))
        drawn_trials += [group[index] for index in sorted(draw.permutation(len(group))[:count])]
    return drawn_trials


def _key(trial: _Trial) -> tuple[float, int]:
    return trial.frequency_hz, _rung(trial.level_n)


def _rung(level_n: float) -> int:
    """Class of a level, in steps of `LEVEL_STEP_DB` relative to 1 N."""
    return round(20 * math.log10(max(level_n, 1e-6)) / LEVEL_STEP_DB)


def _concatenate_trials(trials: Sequence[_Trial], folder: SessionFolder, draw: np.random.Generator) -> Recording:
    """The trials, each with its lead, as a recording with a segment for each trial. trials: sorted by `_key`."""
    first = trials[0].recording
    lead_samples = round(LEAD_S * first.sample_rate_hz)
    parts: list[Mapping[str, FloatArray]] = []
    segments: list[Segment] = []
    trial_start = 0
    for (_, rung), members in groupby(trials, key=_key):
        group = list(members)
        tested = set(draw.permutation(len(group))[: len(group) // TESTED_OF].tolist())
        for index, trial in enumerate(group):
            parts.append(_with_lead(trial.recording, lead_samples))
            segment = trial.recording.segments[0]
            start, stop = trial_start + lead_samples + segment.start, trial_start + lead_samples + segment.stop
            role = "test" if index in tested else "fit"
            period = _group_period(segment.period, trial.recording.sample_rate_hz)
            segments.append(Segment(start, stop, "sine", 10 ** (rung * LEVEL_STEP_DB / 20), period, role))
            trial_start += lead_samples + len(trial.recording)
    decided = _concatenate_signal("command", parts, _excitation(first))
    return Recording(
        device=first.device,
        command=decided,
        response=_concatenate_signal("response", parts, first.response),
        excitation=decided,
        hold=first.hold,
        segments=tuple(segments),
        meta={"session": folder.name, "hand": "held"},
    )


def _excitation(recording: Recording) -> Signal:
    return recording.command if recording.excitation is None else recording.excitation


def _group_period(period: int, sample_rate_hz: float) -> int:
    """Period in samples: `REPEAT_S` where it is a multiple of the trial's own period, otherwise that period."""
    repeat_samples = round(REPEAT_S * sample_rate_hz)
    return repeat_samples if period > 0 and repeat_samples % period == 0 else period


def _with_lead(recording: Recording, lead_samples: int) -> dict[str, FloatArray]:
    """Command and response, (lead + n, channels): before the trial the command is continued periodically and faded in
    over the first half of the lead; the response there is NaN."""
    command, response = _excitation(recording).samples, recording.response.samples
    period = recording.segments[0].period or len(recording)
    fade = np.minimum(1.0, np.arange(lead_samples) / max(1, lead_samples // 2))[:, None]
    lead_command = fade * command[np.arange(-lead_samples, 0) % min(period, len(command))]
    return {
        "command": np.vstack([lead_command, command]),
        "response": np.vstack([np.full((lead_samples, response.shape[1]), np.nan), response]),
    }


def estimate_spring(recordings: Sequence[Recording]) -> float:
    """Stiffness k (N/m) of the virtual spring by least squares from command - excitation = -k position, over all
    channels. 0 where a recording holds no excitation or no complete position of each channel."""
    force_times_position, squared_position = 0.0, 0.0
    for recording in recordings:
        if recording.excitation is None or recording.position is None:
            return 0.0
        position = recording.position.samples
        if position.shape != recording.command.samples.shape or not np.isfinite(position).all():
            return 0.0
        force_times_position -= float(np.sum((recording.command.samples - recording.excitation.samples) * position))
        squared_position += float(np.sum(position**2))
    return force_times_position / squared_position if squared_position > 0 else 0.0


def _concatenate_signal(name: str, parts: Sequence[Mapping[str, FloatArray]], template: Signal) -> Signal:
    return replace(template, samples=np.vstack([part[name] for part in parts]))


def _remarks(
    folder: SessionFolder, trials: Sequence[Any], usable: Sequence[_Trial], drawn_trials: Sequence[_Trial]
) -> Iterator[str]:
    seconds = sum(trial.recording.response.duration_s for trial in drawn_trials)
    yield (
        f"{len(drawn_trials)} of the {len(trials)} trials of {folder.name} were used, {seconds:.0f} s in all, with a "
        "hand on the handle: they contain single frequencies at the levels of the staircases, and no slow or strong "
        "motion and no other frequencies. Effects that show only there cannot be found here."
    )
    if len(usable) < len(trials):
        yield (
            f"{len(trials) - len(usable)} trials were left out: samples were missing, something was wrong while "
            "they were played, or the file was changed since."
        )
    yield (
        f"Levels within {LEVEL_STEP_DB:g} dB of each other count as one. Of each frequency and level, one trial in "
        f"{TESTED_OF} is kept for the test."
    )
