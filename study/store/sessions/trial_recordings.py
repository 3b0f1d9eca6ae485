"""Recording of each trial, beside the log: written once, named by run, trial and attempt."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from equalizer.signals.recording import Recording
from study.store.disk.provenance import sha256_of
from study.store.formats.recording_file import read_recording, write_recording
from study.store.sessions.archive import SessionFolder

PROBE_PREFIX = "probe-"
"""File name prefix of recordings of a probe instead of a trial."""


@dataclass(frozen=True, slots=True)
class SavedRecording:
    """A recording in a session's folder, and its hash for the log."""

    name: str
    """Relative to the session folder."""
    sha256: str


def recording_name(run: int, trial: int, attempt: int) -> str:
    """Name of a trial's recording, relative to the session folder."""
    return f"recordings/run-{run:02d}_trial-{trial:03d}_attempt-{attempt}.h5"


def probe_name(number: int) -> str:
    """Name of a probe's recording, relative to the session folder."""
    return f"recordings/{PROBE_PREFIX}{number:03d}.h5"


def save_trial_recording(
    folder: SessionFolder, name: str, recording: Recording, conditions: Mapping[str, Any]
) -> SavedRecording:
    """Save a trial's recording; on return it is on the disk. conditions: JSON values about what was played and the
    device's state.

    Nothing is overwritten: if a disk lost the end of a log but not its recordings, the name gets a number.
    """
    name = _free_name(folder.path, name)
    path = folder.path / name
    write_recording(path, replace(recording, meta={**recording.meta, **conditions}), precision="float32")
    return SavedRecording(name, sha256_of(path))


def find_trial_recording(folder: SessionFolder, name: str) -> tuple[SavedRecording, Recording] | None:
    """A recording on the disk that the log does not mention; the latest of its name.

    Raises StudyError if it cannot be read.
    """
    stem = Path(name).stem
    of_trial = [path for path in folder.recordings.glob(f"{stem}_*.h5") if path.stem.rpartition("_")[2].isdigit()]
    numbered = sorted(of_trial, key=lambda path: int(path.stem.rpartition("_")[2]))
    path = [folder.path / name, *numbered][-1]
    if not path.exists():
        return None
    return SavedRecording(path.relative_to(folder.path).as_posix(), sha256_of(path)), read_recording(path)


def _free_name(folder: Path, name: str) -> str:
    taken = 1
    free = name
    while (folder / free).exists():
        taken += 1
        free = name.replace(".h5", f"_{taken}.h5")
    return free
