"""Play the pieces of a recording one after another, for `record_device`.

A piece is played again with a lower amplitude where the sensor or the force reached its limit. Each play of a piece is
a take; the last take is kept."""

from collections.abc import Callable
from dataclasses import dataclass

from equalizer.signals.recording import Recording
from protocols.definition.recording_protocol import RecordingProtocol
from study.devices.device import Device, Fault, Health
from study.errors import DeviceError
from study.session.stimulus.recording_pieces import RecordingPiece, make_pieces

AMPLITUDE_FACTOR = 0.7
"""Factor of the amplitude at each further take (3 dB): 0.17 after five. A choice, not a derived value."""

MOST_TAKES = 6
"""Largest number of takes of a piece: a sensor that clips at 0.17 of the amplitude is faulty or configured for another
device."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedTake:
    """The kept take of a piece; unless `is_clipped(health)`, nothing was at its limit."""

    piece: RecordingPiece
    requested_n: float
    """Amplitude that the protocol requests (N)."""
    tries: int
    """Number of takes, the kept one included."""
    sensor_clipped_before: int
    """Clipped samples of the accelerometer in the discarded takes."""
    total_clipped_before: int
    """Ticks at the cap of the total force, or of the spring's, in the discarded takes."""
    recording: Recording
    health: Health

    @property
    def played_n(self) -> float:
        """Amplitude as finally played (N); below `requested_n` where something clipped before."""
        return self.piece.segment.amplitude


def is_clipped(health: Health) -> bool:
    """Whether something was at its limit, so that the take does not show the device alone."""
    return bool(health.sensor_clipped or health.total_clipped or health.feedback_clipped)


def play_pieces(
    protocol: RecordingProtocol, device: Device, takes: list[RecordedTake], on_progress: Callable[[float], None]
) -> None:
    """Play the whole protocol, appending the kept take of each piece to `takes`. `on_progress(seconds)` steps back
    where a piece is repeated. A lowered amplitude is kept for later repetitions of the same segment.

    Raises `DeviceError` when the device stops.
    """
    total_s = 0.0
    amplitude_shares: dict[tuple[int, float | None], float] = {}
    for piece in make_pieces(protocol, device.info.sample_rate_hz):
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
        takes.append(take)
        total_s += piece_s
        on_progress(total_s)


def _repeat_until_unclipped(
    protocol: RecordingProtocol,
    device: Device,
    piece: RecordingPiece,
    amplitude_share: float,
    on_share: Callable[[float], None],
) -> RecordedTake:
    """The first take in which nothing was at its limit, or the last take. amplitude_share: amplitude of the first take
    relative to the requested amplitude."""
    requested_n = piece.segment.amplitude
    least_n = min(protocol.least_amplitude_n, requested_n)
    amplitude_n, sensor_clipped, total_clipped = amplitude_share * requested_n, 0, 0
    for tries in range(1, MOST_TAKES + 1):
        scaled_piece = piece if amplitude_n == requested_n else piece.scale_to(amplitude_n)
        recording, health = _play_take(device, scaled_piece, on_share)
        is_last = tries == MOST_TAKES or amplitude_n <= least_n or not protocol.lower_on_clip
        if is_last or not is_clipped(health):
            break
        sensor_clipped += health.sensor_clipped
        total_clipped += health.total_clipped + health.feedback_clipped
        amplitude_n = max(AMPLITUDE_FACTOR * amplitude_n, least_n)
    return RecordedTake(scaled_piece, requested_n, tries, sensor_clipped, total_clipped, recording, health)


def _play_take(device: Device, piece: RecordingPiece, on_share: Callable[[float], None]) -> tuple[Recording, Health]:
    """Play a piece once. Raises DeviceError where the device stopped."""
    play_result = device.play(piece.commands, on_share)
    if play_result.recording is None or play_result.health.fault is not Fault.NONE:
        raise DeviceError(
            "The device let go",
            f"While recording along {describe_direction(piece)}: {play_result.health.fault.value}.",
            "Check the device and record again.",
        )
    return play_result.recording, play_result.health


def describe_direction(piece: RecordingPiece) -> str:
    """The direction of a piece for a sentence: an axis, or "all axes"."""
    return "all axes" if piece.direction_name == "all" else piece.direction_name
