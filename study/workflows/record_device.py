"""Play a recording protocol on the device, piece by piece, and keep what came back in one file."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from equalizer.signals.joining import join
from equalizer.signals.recording import Recording
from protocols.hashing import protocol_hash
from protocols.recording_protocol import RecordingProtocol
from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Device, DeviceSettings, Fault, Health
from study.devices.opening import DEVICES, open_device
from study.errors import DeviceError, LeftError, StudyError
from study.session.limits import limits_of_recording
from study.session.recording_plan import Piece, pieces
from study.store.provenance import gather_provenance
from study.store.recording_file import write_recording

NOMINAL_RATE_HZ = 1000.0


@dataclass(frozen=True, slots=True)
class RecordingPlan:
    protocol: RecordingProtocol
    device: str
    place_m: tuple[float, float, float]
    seed: int
    out: Path

    @property
    def total_s(self) -> float:
        return sum(piece.commands.duration_s for piece in pieces(self.protocol, NOMINAL_RATE_HZ))


@dataclass(frozen=True, slots=True)
class WrittenRecording:
    path: Path
    warnings: tuple[str, ...]


def record_device(plan: RecordingPlan, on_progress: Callable[[float], None]) -> WrittenRecording:
    """Record everything the protocol asks for. `on_progress(seconds)` counts recorded time.

    Interrupted (KeyboardInterrupt), the pieces that are whole are written, and LeftError says so.
    Raises StudyError before anything moves where `out` exists already.
    """
    check_free(plan.out)
    clock = VirtualClock() if plan.device in DEVICES else RealClock()
    with contextlib.closing(open_device(plan.device, _settings(plan), clock, plan.seed)) as device:
        done: list[tuple[Piece, Recording, Health]] = []
        try:
            _play_all(plan.protocol, device, done, on_progress)
        except KeyboardInterrupt as interruption:
            _write_whole_pieces(plan, device, done)
            if device.fault() is Fault.FORCE_LEFT:
                raise _still_on(plan, len(done)) from interruption
            raise _left(plan, len(done)) from interruption
        except DeviceError as error:
            _write_whole_pieces(plan, device, done)
            error.saved = _saved(plan, len(done))
            raise
        return _write(plan, device, done, interrupted=False)


def check_free(out: Path) -> None:
    """Raises StudyError where the recording could not be written under this name."""
    if out.exists():
        raise StudyError(
            "The recording was not started",
            f"{out} exists already, and recordings are never overwritten.",
            "Choose another name with --out.",
            saved="Nothing moved.",
        )
    if not out.absolute().parent.is_dir():
        raise StudyError(
            "The recording was not started",
            f"There is no folder {out.parent} to write {out.name} into.",
            "Make the folder first, or choose another name with --out.",
            saved="Nothing moved.",
        )


def _play_all(
    protocol: RecordingProtocol,
    device: Device,
    done: list[tuple[Piece, Recording, Health]],
    on_progress: Callable[[float], None],
) -> None:
    before_s = 0.0
    for piece in pieces(protocol, device.info.sample_rate_hz):
        length_s, started_s = piece.commands.duration_s, before_s
        played = device.play(piece.commands, lambda share: on_progress(started_s + share * length_s))  # noqa: B023
        if played.recording is None or played.health.fault is not Fault.NONE:
            raise DeviceError(
                "The device let go",
                f"While recording along {piece.along}: {played.health.fault.value}.",
                "Check the device and record again.",
            )
        done.append((piece, played.recording, played.health))
        before_s += length_s
        on_progress(before_s)


def _left(plan: RecordingPlan, done: int) -> LeftError:
    all_pieces = len(pieces(plan.protocol, NOMINAL_RATE_HZ))
    return LeftError(
        "Interrupted",
        f"{done} of {all_pieces} pieces were recorded; the force was released.",
        "Record again under another name for the whole protocol.",
        saved=_saved(plan, done),
    )


def _still_on(plan: RecordingPlan, done: int) -> DeviceError:
    return DeviceError(
        "The force may still be on", Fault.FORCE_LEFT.sentence, "Then record again.", saved=_saved(plan, done)
    )


def _saved(plan: RecordingPlan, done: int) -> str:
    return f"The {done} whole pieces are in {plan.out}." if done else "Nothing was written."


def _write_whole_pieces(plan: RecordingPlan, device: Device, done: list[tuple[Piece, Recording, Health]]) -> None:
    if done:
        _write(plan, device, done, interrupted=True)


def _settings(plan: RecordingPlan) -> DeviceSettings:
    return DeviceSettings(
        limits=limits_of_recording(plan.protocol),
        spring_frequency_hz=plan.protocol.spring.natural_frequency_hz,
        spring_damping_n_s_per_m=plan.protocol.spring.damping_n_s_per_m,
        keep_s=1.0,
        hand_on_handle=plan.protocol.hand == "held",
        place_m=plan.place_m,
    )


def _write(
    plan: RecordingPlan, device: Device, done: list[tuple[Piece, Recording, Health]], interrupted: bool
) -> WrittenRecording:
    parts = [replace(recording, segments=(piece.segment,)) for piece, recording, _ in done]
    write_recording(plan.out, join(parts, _meta(plan, device, done, interrupted)))
    return WrittenRecording(plan.out, _warnings(done))


def _meta(
    plan: RecordingPlan, device: Device, done: list[tuple[Piece, Recording, Health]], interrupted: bool
) -> dict[str, Any]:
    protocol = plan.protocol
    return {
        "protocol": protocol.name,
        "place_m": list(plan.place_m),
        "hand": protocol.hand,
        "feedback": {
            "kind": "virtual spring about the place",
            "natural_frequency_hz": protocol.spring.natural_frequency_hz,
            "damping_n_s_per_m": protocol.spring.damping_n_s_per_m,
            "effective_mass_kg": device.info.effective_mass_kg,
        },
        # As mounted: what is off by the mounting's tolerance is not known to whoever records.
        "sensor": {"frame_to_device": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]},
        "interrupted": interrupted,
        "segments": [
            {"frequency_hz": p.frequency_hz, "along": p.along, "unit_vector": list(p.unit_vector)} for p, _, _ in done
        ],
        "provenance": gather_provenance(
            protocol_hash=protocol_hash(protocol), seeds={"device": plan.seed}, parents=()
        ).as_dict(),
    }


def _warnings(done: list[tuple[Piece, Recording, Health]]) -> tuple[str, ...]:
    found = []
    for piece, _, health in done:
        what = f"{piece.frequency_hz:g} Hz" if piece.frequency_hz else piece.segment.kind
        if health.sensor_clipped:
            found.append(f"The accelerometer clipped in {health.sensor_clipped} samples ({what} along {piece.along}).")
        if health.total_clipped or health.stimulus_clipped:
            found.append(f"The force was limited at its cap ({what} along {piece.along}).")
        if health.missed_ticks:
            found.append(f"{health.missed_ticks} ticks were missed ({what} along {piece.along}); they are NaN.")
        if health.slew_limited:
            found.append(f"The force was slowed by the slew limit ({what} along {piece.along}).")
    return tuple(found)
