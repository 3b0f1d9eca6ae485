"""Cache of the recordings for the reproduced figures: each is made once and reused by later runs.

A recording is reused only where protocol, seed, position of the handle and version of hapteq agree with the request.
The device is not compared: each file name stands for a single simulated device, which changes with the version only. A
recording that differs is not overwritten (StudyError); otherwise an interrupted one is removed and made again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from equalizer.signals.recording import Recording
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.document.hashing import hash_protocol
from study.devices.opening import SIMULATED
from study.errors import StudyError
from study.evaluation.reproduction.reproduction_plan import CENTRE, Place, ReproductionPlan
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.provenance import list_versions
from study.store.formats.protocol_files import read_recording_protocol
from study.store.formats.recording_file import read_recording
from study.workflows.recording.record_device import RecordingPlan, record_device


@dataclass(frozen=True, slots=True)
class RecordingRequest:
    """Settings of one recording, and the name of its file."""

    name: str
    """Name of the file, without the ending .h5."""
    protocol: str
    """Name of a shipped recording protocol, or path of a protocol file."""
    place_m: Place = CENTRE
    """Position of the handle, x, y, z (m)."""
    device: str = SIMULATED
    """Name of the device that is recorded."""


@dataclass(frozen=True, slots=True, eq=False)
class CachedRecording:
    """A recording of the reproduction, loaded from its file or new."""

    path: Path
    recording: Recording
    warnings: tuple[str, ...]
    """Sentences about segments with a reduced amplitude."""


def record_or_load(
    plan: ReproductionPlan, request: RecordingRequest, on_progress: Callable[[float], None]
) -> CachedRecording:
    """Load the cached recording, or make it. on_progress: called with the fraction done, 0 to 1. Raises DeviceError,
    and StudyError where the folder contains a recording of another run under this name."""
    path = plan.recordings / f"{request.name}.h5"
    protocol = read_recording_protocol(request.protocol).protocol
    recording = _load_cached_recording(path, plan, request, protocol)
    if recording is None:
        recording_plan = RecordingPlan(protocol, request.device, request.place_m, plan.seed, path)
        total_s = recording_plan.total_s
        record_device(recording_plan, lambda seconds: on_progress(seconds / total_s))
        recording = read_recording(path)
    on_progress(1.0)
    return CachedRecording(path, recording, _list_reduced_amplitudes(recording))


def _load_cached_recording(
    path: Path, plan: ReproductionPlan, request: RecordingRequest, protocol: RecordingProtocol
) -> Recording | None:
    """Load the cached recording; None where there is none, or an interrupted one of this run, which is removed. Raises
    StudyError for a file that cannot be read or belongs to another run."""
    if not path.exists():
        return None
    try:
        recording = read_recording(path)
    except UnusableFileError as problem:
        raise _make_foreign_file_error(path, "it cannot be read") from problem
    meta = recording.meta
    provenance: dict[str, Any] = meta.get("provenance", {})
    if provenance.get("protocol_hash") != hash_protocol(protocol):
        raise _make_foreign_file_error(path, "it follows another protocol")
    if provenance.get("seeds") != {"device": plan.seed}:
        raise _make_foreign_file_error(path, "it was made with another seed")
    if provenance.get("versions", {}).get("hapteq") != list_versions()["hapteq"]:
        raise _make_foreign_file_error(path, "it was made with another version of hapteq")
    if tuple(meta.get("place_m", ())) != request.place_m:
        raise _make_foreign_file_error(path, "it was made at another place")
    if meta.get("interrupted"):
        path.unlink()
        return None
    return recording


def _list_reduced_amplitudes(recording: Recording) -> tuple[str, ...]:
    """List, as sentences, the segments whose amplitude (N) was lower than requested, also for cached recordings."""
    return tuple(
        f"Played at {segment['played_amplitude_n']:.3g} N instead of {segment['requested_amplitude_n']:.3g} N along "
        f"{segment['along']}, because something was at its limit."
        for segment in recording.meta.get("segments", ())
        if segment["played_amplitude_n"] < segment["requested_amplitude_n"]
    )


def _make_foreign_file_error(path: Path, reason: str) -> StudyError:
    """Make the error for a file that does not belong to this reproduction. reason: a clause."""
    return StudyError(
        "This folder holds another reproduction",
        f"{path} is in the way: {reason}.",
        "Choose another folder with --out, or the same --seed and version to continue.",
        saved="Nothing was changed.",
    )
