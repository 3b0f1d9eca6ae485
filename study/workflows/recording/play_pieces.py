"""Play the pieces of a recording one after another; repeat a piece with lower force where sensor or force was at its
limit."""

from collections.abc import Callable
from dataclasses import dataclass

from equalizer.signals.recording import Recording
from protocols.definition.recording_protocol import RecordingProtocol
from study.devices.device import Device, Fault, Health
from study.errors import DeviceError
from study.session.stimulus.recording_pieces import Piece, pieces

LOWERED_TO = 0.7
"""Factor of the amplitude at each repetition, 3 dB: after five, a sixth is left. By hand."""

MOST_TRIES = 6
"""Attempts per piece: a sensor that clips at a sixth is broken or configured for another device."""


@dataclass(frozen=True, slots=True, eq=False)
class PlayedPiece:
    """A piece as finally played: nothing was at its limit unless `clipped`."""

    piece: Piece
    requested_n: float
    tries: int
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
    protocol: RecordingProtocol, device: Device, done: list[PlayedPiece], on_progress: Callable[[float], None]
) -> None:
    """Play the whole protocol, appending each finished piece to `done`. `on_progress(seconds)` steps back where a piece
    is repeated. A lowered amplitude is kept for later rounds of the same segment.

    Raises `DeviceError` when the device stops.
    """
    before_s = 0.0
    shares: dict[tuple[int, float | None], float] = {}
    for piece in pieces(protocol, device.info.sample_rate_hz):
        length_s, started_s = piece.commands.duration_s, before_s
        same = (piece.number, piece.frequency_hz)
        take = _play_until_unclipped(
            protocol,
            device,
            piece,
            shares.get(same, 1.0),
            lambda share: on_progress(started_s + share * length_s),  # noqa: B023
        )
        shares[same] = take.played_n / take.requested_n
        done.append(take)
        before_s += length_s
        on_progress(before_s)


def _play_until_unclipped(
    protocol: RecordingProtocol, device: Device, piece: Piece, share: float, on_share: Callable[[float], None]
) -> PlayedPiece:
    """The first take in which nothing was at its limit, or the last one."""
    requested_n = piece.segment.amplitude
    least_n = min(protocol.least_amplitude_n, requested_n)
    amplitude_n, sensor_before, total_before = share * requested_n, 0, 0
    for tries in range(1, MOST_TRIES + 1):
        played = piece if amplitude_n == requested_n else piece.at(amplitude_n)
        recording, health = _play_once(device, played, on_share)
        last = tries == MOST_TRIES or amplitude_n <= least_n or not protocol.lower_on_clip
        if last or not is_clipped(health):
            break
        sensor_before += health.sensor_clipped
        total_before += health.total_clipped + health.feedback_clipped
        amplitude_n = max(LOWERED_TO * amplitude_n, least_n)
    return PlayedPiece(played, requested_n, tries, sensor_before, total_before, recording, health)


def _play_once(device: Device, piece: Piece, on_share: Callable[[float], None]) -> tuple[Recording, Health]:
    played = device.play(piece.commands, on_share)
    if played.recording is None or played.health.fault is not Fault.NONE:
        raise DeviceError(
            "The device let go",
            f"While recording along {direction_text(piece)}: {played.health.fault.value}.",
            "Check the device and record again.",
        )
    return played.recording, played.health


def direction_text(piece: Piece) -> str:
    """The direction of a piece for a sentence: an axis, or "all axes"."""
    return "all axes" if piece.along == "all" else piece.along
