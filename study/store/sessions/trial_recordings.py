"""The recording of each trial and of each probe, a file of its own in the session's folder.

A file is written once, before the log mentions it with its hash; its name holds run, trial and attempt. So a recording
that the log does not mention yet can be found again after a crash.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from equalizer.signals.recording import Recording
from study.store.disk.provenance import compute_sha256
from study.store.formats.recording_file import read_recording, write_recording
from study.store.sessions.archive import SessionFolder

PROBE_PREFIX = "probe-"
"""Start of the file name of a probe's recording."""


@dataclass(frozen=True, slots=True)
class SavedRecording:
    """A recording in a session's folder, as the log names it."""

    name: str
    """Path relative to the session's folder."""
    sha256: str
    """Hash of the file."""


def recording_name(run: int, trial: int, attempt: int) -> str:
    """Path of a trial's recording, relative to the session's folder. run, trial, attempt: from 0."""
    return f"recordings/run-{run:02d}_trial-{trial:03d}_attempt-{attempt}.h5"


def probe_name(number: int) -> str:
    """Path of a probe's recording, relative to the session's folder. number: of the probe in the session, from 0."""
    return f"recordings/{PROBE_PREFIX}{number:03d}.h5"


def save_trial_recording(
    folder: SessionFolder, name: str, recording: Recording, conditions: Mapping[str, Any]
) -> SavedRecording:
    """Save the recording of a trial or probe; on return it is on the disk, as 32-bit floating-point numbers.

    conditions: JSON values about what was played and the state of the device. No file is overwritten: where one of this
    name exists, because the end of a log was lost but not the recordings, the name gets a number. Raises StudyError
    where the file cannot be written.
    """
    name = _find_free_name(folder.path, name)
    path = folder.path / name
    write_recording(path, replace(recording, meta={**recording.meta, **conditions}), precision="float32")
    return SavedRecording(name, compute_sha256(path))


def find_trial_recording(folder: SessionFolder, name: str) -> tuple[SavedRecording, Recording] | None:
    """The latest recording of this name on the disk, which the log need not mention; None where there is none.

    Raises StudyError where it cannot be read.
    """
    stem = Path(name).stem
    trial_paths = [path for path in folder.recordings.glob(f"{stem}_*.h5") if path.stem.rpartition("_")[2].isdigit()]
    numbered_paths = sorted(trial_paths, key=lambda path: int(path.stem.rpartition("_")[2]))
    path = [folder.path / name, *numbered_paths][-1]
    if not path.exists():
        return None
    return SavedRecording(path.relative_to(folder.path).as_posix(), compute_sha256(path)), read_recording(path)


def _find_free_name(folder: Path, name: str) -> str:
    """The name, or with the lowest number from 2 on that makes it new."""
    number = 1
    free = name
    while (folder / free).exists():
        number += 1
        free = name.replace(".h5", f"_{number}.h5")
    return free
