"""Save and find the recordings of trials and probes: one HDF5 file for each, in the session's folder.

A file is written once, before its name and hash are logged; its name states run, trial and attempt, or the number of
the probe. After a crash, a recording that is not logged yet is therefore found again.
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
    """A recording in a session's folder, as it is logged."""

    name: str
    """Path relative to the session's folder."""
    sha256: str
    """Of the file, in hexadecimal."""


def name_recording(run: int, trial: int, attempt: int) -> str:
    """Return the path of a trial's recording, relative to the session's folder. run, trial, attempt: indices from 0."""
    return f"recordings/run-{run:02d}_trial-{trial:03d}_attempt-{attempt}.h5"


def name_probe_recording(number: int) -> str:
    """Return the path of a probe's recording, relative to the session's folder. number: index from 0."""
    return f"recordings/{PROBE_PREFIX}{number:03d}.h5"


def save_trial_recording(
    folder: SessionFolder, name: str, recording: Recording, conditions: Mapping[str, Any]
) -> SavedRecording:
    """Save the recording of a trial or probe; on return it is on the disk, all signals but the position (float64) as
    32-bit floating-point numbers.

    conditions: JSON values about what was played and the state of the device. No file is overwritten: where one of this
    name exists, because the end of a log was lost but not the recordings, the name gets a number. Raises
    CannotWriteError where the file cannot be written, ValueError for an inconsistent recording or NaN in the
    conditions."""
    name = _find_free_name(folder.path, name)
    path = folder.path / name
    write_recording(path, replace(recording, meta={**recording.meta, **conditions}), precision="float32")
    return SavedRecording(name, compute_sha256(path))


def find_trial_recording(folder: SessionFolder, name: str) -> tuple[SavedRecording, Recording] | None:
    """Find and read the latest recording that was saved under this name, whether or not it is logged; None where there
    is none. Raises CannotReadError or UnusableFileError where it cannot be read."""
    stem = Path(name).stem
    trial_paths = [path for path in folder.recordings.glob(f"{stem}_*.h5") if path.stem.rpartition("_")[2].isdigit()]
    numbered_paths = sorted(trial_paths, key=lambda path: int(path.stem.rpartition("_")[2]))
    path = [folder.path / name, *numbered_paths][-1]
    if not path.exists():
        return None
    return SavedRecording(path.relative_to(folder.path).as_posix(), compute_sha256(path)), read_recording(path)


def _find_free_name(folder: Path, name: str) -> str:
    """Return the name or, where such a file exists, the name with the lowest number from 2 on that makes it new."""
    number = 1
    free_name = name
    while (folder / free_name).exists():
        number += 1
        free_name = name.replace(".h5", f"_{number}.h5")
    return free_name
