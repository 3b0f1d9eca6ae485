"""Record a device: play all pieces of a recording protocol on it, and write commands and readings into one HDF5 file.

Each piece is one excitation with a rest before and after it (`recording_pieces`). If the user interrupts or the device
fails, the pieces that are complete are written.
"""

import contextlib
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from equalizer.signals.joining import join_recordings
from equalizer.signals.recording import Recording
from protocols.definition.new_use import NOMINAL_RATE_HZ
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.document.hashing import hash_protocol
from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Device, DeviceSettings, Fault
from study.devices.opening import needs_real_time, open_device
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.stimulus.limits import make_recording_limits
from study.session.stimulus.recording_pieces import RecordingPiece, make_pieces
from study.session.views.handle_notice import BeforeMoving, format_recording_notice, refuse_unannounced
from study.store.disk.atomic_write import reserve_space
from study.store.disk.file_errors import AlreadyExistsError, CannotWriteError
from study.store.disk.provenance import gather_provenance
from study.store.formats.recording_file import write_recording
from study.workflows.ignored_interrupts import ignore_interrupts
from study.workflows.output_paths import require_new_outputs
from study.workflows.recording.play_pieces import RecordedTake, play_pieces
from study.workflows.recording.recording_metadata import describe_segment, describe_spring, list_warnings

BYTES_PER_SAMPLE, BYTES_PER_PIECE, BYTES_PER_FILE = 100, 4096, 2**17
"""Upper bounds of what a sample, a piece and the rest take in the file: four signals of three channels, of 8 bytes and
their checksums; segment and metadata; structures of HDF5, with the empty part of the chunks of signals that are too
short for compression (up to 86 kB). Chosen."""


@dataclass(frozen=True, slots=True)
class RecordingPlan:
    """Protocol, device, place of the handle and output file of a recording."""

    protocol: RecordingProtocol
    device: str
    """Name of the device, as on the command line."""
    place_m: tuple[float, float, float]
    """Equilibrium position of the virtual spring that holds the handle: x, y, z in m."""
    seed: int
    """Seed of the random numbers of a simulated device."""
    out: Path
    """File to write, which must not exist."""

    @property
    def total_s(self) -> float:
        """Duration (s) of all pieces, each played once, at the nominal rate."""
        return sum(piece.commands.duration_s for piece in make_pieces(self.protocol, NOMINAL_RATE_HZ))


@dataclass(frozen=True, slots=True)
class WrittenRecording:
    """File of a recording, and warnings about its pieces as sentences."""

    path: Path
    warnings: tuple[str, ...]


def record_device(
    plan: RecordingPlan,
    on_progress: Callable[[float], None] = lambda seconds: None,
    before_moving: BeforeMoving = refuse_unannounced,
) -> WrittenRecording:
    """Record the whole protocol. `on_progress(seconds)` receives the recorded time, which decreases when a piece is
    repeated. `before_moving(notice)` is called before a real device moves, with the notice for the people around it;
    an exception from it keeps the device still. The default refuses every real device.

    Raises StudyError before anything moves if `out` exists already, has no folder, or no space is left for it: that is
    reserved until the file is written. Raises AlreadyExistsError if a file of that name was made while the device
    moved; the recording is then written beside it. Raises UserInterruptError after KeyboardInterrupt, and DeviceError
    if the device fails or may still exert a force after the interruption; the complete pieces are written before, and
    an error of the writing is in `saved`.
    """
    require_new_output(plan.out)
    clock = RealClock() if needs_real_time(plan.device) else VirtualClock()
    with contextlib.closing(open_device(plan.device, make_recording_settings(plan), clock, plan.seed)) as device:
        return record_on_device(device, plan, on_progress, before_moving)


def record_on_device(
    device: Device,
    plan: RecordingPlan,
    on_progress: Callable[[float], None],
    before_moving: BeforeMoving = refuse_unannounced,
) -> WrittenRecording:
    """Record on an open device, whose settings are those of `make_recording_settings`. Arguments and errors are as for
    `record_device`, but `require_new_output` is left to the caller."""
    takes: list[RecordedTake] = []
    pieces = make_pieces(plan.protocol, device.info.sample_rate_hz)
    try:
        with _reserve_space(plan, pieces):
            if not device.info.simulated:
                before_moving(format_recording_notice(plan.protocol, device.info.name, plan.total_s))
            play_pieces(plan.protocol, pieces, device, takes, on_progress)
    except KeyboardInterrupt as interruption:
        saved = _write_complete_takes(plan, device, takes)
        if device.fault() is Fault.FORCE_LEFT:  # more important to say than the interruption
            raise DeviceError(
                "The force may still be on", Fault.FORCE_LEFT.sentence, "Then record again.", saved=saved
            ) from interruption
        raise _make_interrupted_error(plan, len(takes), saved) from interruption
    except DeviceError as error:
        error.saved = _write_complete_takes(plan, device, takes)
        raise
    return _write_takes(plan, device, takes, interrupted=False)


@contextlib.contextmanager
def _reserve_space(plan: RecordingPlan, pieces: Sequence[RecordingPiece]) -> Iterator[None]:
    """Context that keeps free space for the file, which is written at the end. Raises CannotWriteError before the body
    where there is none."""
    sample_count = sum(len(piece.commands) for piece in pieces)
    size_bytes = BYTES_PER_SAMPLE * sample_count + BYTES_PER_PIECE * len(pieces) + BYTES_PER_FILE
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(reserve_space(plan.out, size_bytes))
        except CannotWriteError as error:
            error.saved = "Nothing moved, and nothing was written."
            raise
        yield


def require_new_output(out_path: Path) -> None:
    """Raise StudyError if a file of this name exists, or its folder does not."""
    require_new_outputs(out_path, title="The recording was not started", kind="recordings", saved="Nothing moved.")


def _make_interrupted_error(plan: RecordingPlan, take_count: int, saved: str) -> UserInterruptError:
    """Make the error after an interruption with the force released. take_count: number of complete pieces; saved:
    sentence on them."""
    piece_count = len(make_pieces(plan.protocol, NOMINAL_RATE_HZ))
    return UserInterruptError(
        "Interrupted",
        f"{take_count} of {piece_count} pieces were recorded; the force was released.",
        "Record again under another name for the whole protocol.",
        saved=saved,
    )


def _write_complete_takes(plan: RecordingPlan, device: Device, takes: list[RecordedTake]) -> str:
    """Write the complete pieces of an interrupted recording, if there are any. Returns a sentence on what was written;
    an error of the writing is part of it, so that it does not hide why the recording ended."""
    if not takes:
        return "Nothing was written."
    try:
        _write_takes(plan, device, takes, interrupted=True)
    except StudyError as error:
        return f"{error.title}. {error.happened} {error.saved}".rstrip()
    return f"The {len(takes)} whole pieces are in {plan.out}."


def make_recording_settings(plan: RecordingPlan) -> DeviceSettings:
    """Make the settings with which the device is opened: force limits, virtual spring, and place of the handle."""
    return DeviceSettings(
        limits=make_recording_limits(plan.protocol),
        spring_frequency_hz=plan.protocol.spring.natural_frequency_hz,
        spring_damping_n_s_per_m=plan.protocol.spring.damping_n_s_per_m,
        keep_s=1.0,  # without effect: it limits the recording of held stimuli only
        hand_on_handle=plan.protocol.hand == "held",
        place_m=plan.place_m,
    )


def _write_takes(plan: RecordingPlan, device: Device, takes: list[RecordedTake], interrupted: bool) -> WrittenRecording:
    """Join the pieces into one recording with a segment each, and write it."""
    with ignore_interrupts():
        piece_recordings = [replace(take.recording, segments=(take.piece.segment,)) for take in takes]
        recording = join_recordings(piece_recordings, _make_metadata(plan, device, takes, interrupted))
        _write_or_keep(plan.out, recording)
    return WrittenRecording(plan.out, tuple(warning for take in takes for warning in list_warnings(take)))


def _write_or_keep(path: Path, recording: Recording) -> None:
    """Write the recording. Where a file of this name was made while the device moved, write it beside that file, under
    a free name, and raise AlreadyExistsError, which states it."""
    try:
        write_recording(path, recording)
    except AlreadyExistsError as error:
        for number in itertools.count(2):
            free_path = path.with_stem(f"{path.stem}_{number}")
            with contextlib.suppress(AlreadyExistsError):
                write_recording(free_path, recording)
                break
        error.saved, error.do_now = f"The file is as it was; the recording is in {free_path}.", "Go on with that file."
        raise


def _make_metadata(plan: RecordingPlan, device: Device, takes: list[RecordedTake], interrupted: bool) -> dict[str, Any]:
    """Make the metadata of the recording's file: protocol, place, spring, description of each segment, provenance."""
    protocol = plan.protocol
    return {
        "protocol": protocol.name,
        "place_m": list(plan.place_m),
        "hand": protocol.hand,
        "feedback": describe_spring(protocol.spring, device.info.effective_mass_kg),
        # Nominal mounting: the actual misalignment within its tolerance is not known when it is recorded.
        "sensor": {"frame_to_device": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]},
        "interrupted": interrupted,
        "segments": [describe_segment(take) for take in takes],
        "provenance": gather_provenance(
            protocol_hash=hash_protocol(protocol), seeds={"device": plan.seed}, parents=()
        ).as_dict(),
    }
