"""Play the pieces of a recording protocol on a device one after another.

A piece is a sinusoid, a sweep or a multisine realisation; each play of a piece is a take. Where the sensor or the force
reached its limit, and the protocol allows it (`lower_on_clip`), the piece is played again with a lower amplitude; the
last take is kept.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from equalizer.signals.recording import Recording
from protocols.definition.recording_protocol import RecordingProtocol
from study.devices.device import Device, Fault, Health
from study.errors import DeviceError
from study.session.stimulus.recording_pieces import RecordingPiece

AMPLITUDE_REDUCTION = 0.7
"""Factor of the amplitude from a take to the next (-3 dB): 0.17 after five reductions. Chosen."""

MAX_TAKES = 6
"""Largest number of takes of a piece. Chosen: a sensor that clips at 0.17 of the amplitude is faulty, or configured for
another device."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedTake:
    """The kept take of a piece, which may be clipped (`is_clipped(health)`)."""

    piece: RecordingPiece
    """The piece as finally played, with its amplitude."""
    requested_n: float
    """Amplitude that the protocol requests (N)."""
    tries: int
    """Number of takes, the kept one included."""
    sensor_clipped_before: int
    """Ticks with an accelerometer channel at its limit, in the discarded takes."""
    total_clipped_before: int
    """Ticks at the cap of the total force plus ticks at that of the spring and damper, in the discarded takes."""
    recording: Recording
    """Recording of this take."""
    health: Health
    """Counters of the device during this take."""

    @property
    def played_n(self) -> float:
        """Amplitude as finally played (N); below `requested_n` where an earlier take was clipped."""
        return self.piece.segment.amplitude


def is_clipped(health: Health) -> bool:
    """Whether the accelerometer, the total force, or the force of spring and damper reached its limit in a take."""
    return bool(health.sensor_clipped or health.total_clipped or health.feedback_clipped)


def play_pieces(
    protocol: RecordingProtocol,
    pieces: Sequence[RecordingPiece],
    device: Device,
    kept_takes: list[RecordedTake],
    on_progress: Callable[[float], None],
) -> None:
    """Play the whole protocol, and append the kept take of each piece to `kept_takes`. A lowered amplitude is also used
    for later repetitions of the same segment and frequency.

    pieces: of the protocol, at the device's rate (`make_pieces`). on_progress: called with the seconds played, repeated
    takes not counted; decreases where a piece is repeated. Raises DeviceError where the device stopped; `kept_takes`
    then contains the pieces before.
    """
    total_s = 0.0
    amplitude_shares: dict[tuple[int, float | None], float] = {}
    for piece in pieces:
        piece_s, started_s = piece.commands.duration_s, total_s
        segment_key = (piece.number, piece.frequency_hz)
        take = _repeat_until_unclipped(
            protocol,
            device,
            piece,
            amplitude_shares.get(segment_key, 1.0),
            lambda share: on_progress(started_s + share * piece_s),  # noqa: B023
        )
        amplitude_shares[segment_key] = take.played_n / take.requested_n
        kept_takes.append(take)
        total_s += piece_s
        on_progress(total_s)


def _repeat_until_unclipped(
    protocol: RecordingProtocol,
    device: Device,
    piece: RecordingPiece,
    amplitude_share: float,
    on_progress: Callable[[float], None],
) -> RecordedTake:
    """Play a piece with decreasing amplitude until a take is not clipped (`is_clipped`), and return the last take. It
    may be clipped after `MAX_TAKES` takes, at the protocol's least amplitude, or where the protocol does not lower the
    amplitude. amplitude_share: amplitude of the first take relative to the requested one; on_progress: called with the
    share of the take that is played, 0 to 1."""
    requested_n = piece.segment.amplitude
    min_amplitude_n = min(protocol.least_amplitude_n, requested_n)
    amplitude_n, sensor_clipped_before, total_clipped_before = amplitude_share * requested_n, 0, 0
    for tries in range(1, MAX_TAKES + 1):
        scaled_piece = piece if amplitude_n == requested_n else piece.scale_to(amplitude_n)
        recording, health = _play_take(device, scaled_piece, on_progress)
        is_last = tries == MAX_TAKES or amplitude_n <= min_amplitude_n or not protocol.lower_on_clip
        if is_last or not is_clipped(health):
            break
        sensor_clipped_before += health.sensor_clipped
        total_clipped_before += health.total_clipped + health.feedback_clipped
        amplitude_n = max(AMPLITUDE_REDUCTION * amplitude_n, min_amplitude_n)
    return RecordedTake(
        scaled_piece, requested_n, tries, sensor_clipped_before, total_clipped_before, recording, health
    )


def _play_take(device: Device, piece: RecordingPiece, on_progress: Callable[[float], None]) -> tuple[Recording, Health]:
    """Play a piece once. Raises DeviceError, with the fault, where the device stopped or returned no recording."""
    play_result = device.play(piece.commands, on_progress)
    if play_result.recording is None or play_result.health.fault is not Fault.NONE:
        raise DeviceError(
            "The device let go",
            f"While recording along {describe_piece_direction(piece)}: {play_result.health.fault.value}.",
            "Check the device and record again.",
        )
    return play_result.recording, play_result.health


def describe_piece_direction(piece: RecordingPiece) -> str:
    """Describe the direction of a piece: an axis, a test direction, or "all axes"."""
    return "all axes" if piece.direction_name == "all" else piece.direction_name
