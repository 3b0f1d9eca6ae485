"""Pieces of a recording: the segments of a protocol as commands, a piece for each sinusoid, sweep or multisine
realisation.

    rest | fade in and settling | evaluated part | fade out | rest

An analysis uses only the evaluated part: whole periods at constant amplitude (the first period of a sweep contains its
transient). Each piece is played by itself (`workflows/recording/play_pieces`), and again with less force where the
accelerometer clipped (`RecordingPiece.at`).
"""

from dataclasses import dataclass, replace

import numpy as np

from equalizer.signals.excitation import apply_fades, make_log_sweep, make_sine
from equalizer.signals.multisine import list_lines_between, make_multisines
from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray, Signal
from protocols.definition.apparatus import TestDirections
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import MultisineSegment, SineSegment, SweepSegment
from study.session.stimulus.stimulus import compute_direction_vector, count_loop_samples


@dataclass(frozen=True, slots=True, eq=False)
class RecordingPiece:
    """One excitation with a rest before and after it."""

    commands: Signal
    """(n, 3) in N."""
    segment: Segment
    """The evaluated part, in samples of `commands`."""
    number: int
    """Number of its segment in the protocol, from 1."""
    direction_name: str
    """Axis or test direction of the force: x, y, z, direction_1, direction_2, or all (three axes at once)."""
    unit_vector: tuple[float, float, float] | None
    """Unit vector of the force; None for all axes at once."""
    frequency_hz: float | None = None
    """Frequency of a sinusoid; None for a sweep or a multisine."""
    band_hz: tuple[float, float] | None = None
    """Lowest and highest frequency of a sweep or a multisine; None for a sinusoid."""
    realisation: int = 1
    """Number of the realisation of a multisine's phases, from 1."""

    def scale_to(self, amplitude_n: float) -> "RecordingPiece":
        """The same excitation, scaled to another peak (N)."""
        samples = self.commands.samples * (amplitude_n / self.segment.amplitude)
        return replace(
            self,
            commands=replace(self.commands, samples=samples),
            segment=replace(self.segment, amplitude=amplitude_n),
        )


def make_pieces(protocol: RecordingProtocol, sample_rate_hz: float) -> tuple[RecordingPiece, ...]:
    """All pieces in the order of the protocol's segments, the whole sequence as often as the protocol repeats it.
    sample_rate_hz: sample rate of the device."""
    sequence: list[RecordingPiece] = []
    for number, segment in enumerate(protocol.segments, start=1):
        match segment:
            case SineSegment():
                sequence += [
                    _make_sine_piece(protocol, number, segment, f, sample_rate_hz) for f in segment.frequencies_hz
                ]
            case SweepSegment():
                sequence.append(_make_sweep_piece(protocol, number, segment, sample_rate_hz))
            case MultisineSegment():
                sequence += _make_multisine_pieces(protocol, number, segment, sample_rate_hz)
    return tuple(sequence) * protocol.repeats


def make_unit_vector(directions: TestDirections, axis_name: str) -> FloatArray:
    """Unit vector (3,) of a device axis or of a test direction."""
    if axis_name in ("x", "y", "z"):
        axis: FloatArray = np.eye(3)["xyz".index(axis_name)]
        return axis
    return compute_direction_vector(directions, int(axis_name.removeprefix("direction_")))


def _make_sine_piece(
    protocol: RecordingProtocol, number: int, segment: SineSegment, frequency_hz: float, rate_hz: float
) -> RecordingPiece:
    """A sinusoid. The evaluated part is a whole number of loops of whole periods; settling and fades lie outside."""
    period = count_loop_samples(frequency_hz, rate_hz)
    fade_samples = round(protocol.fade_s * rate_hz)
    settle_samples = max(fade_samples, round(segment.settle_s * rate_hz))
    evaluated_samples = max(1, round(segment.duration_s * rate_hz) // period) * period
    wave = make_sine(frequency_hz, segment.amplitude_n, settle_samples + evaluated_samples + fade_samples, rate_hz)
    vector = make_unit_vector(protocol.directions, segment.along)
    commands, shift = _add_rests(protocol, apply_fades(wave, fade_samples, fade_samples)[:, None] * vector, rate_hz)
    start = shift + settle_samples
    return RecordingPiece(
        commands=commands,
        segment=Segment(start, start + evaluated_samples, "sine", segment.amplitude_n, period, segment.role),
        number=number,
        direction_name=segment.along,
        unit_vector=_to_tuple(vector),
        frequency_hz=frequency_hz,
    )


def _make_sweep_piece(
    protocol: RecordingProtocol, number: int, segment: SweepSegment, rate_hz: float
) -> RecordingPiece:
    """A sweep. With several periods it is faded in during the first, which contains the transient; every period ends at
    zero, so that no fade-out is needed."""
    period = round(segment.duration_s * rate_hz)
    wave = np.tile(
        make_log_sweep(segment.from_hz, segment.to_hz, segment.amplitude_n, period, rate_hz), segment.periods
    )
    vector = make_unit_vector(protocol.directions, segment.along)
    fade_in = round(protocol.fade_s * rate_hz) if segment.periods > 1 else 0
    commands, start = _add_rests(protocol, apply_fades(wave, min(fade_in, period), 0)[:, None] * vector, rate_hz)
    return RecordingPiece(
        commands=commands,
        segment=Segment(start, start + len(wave), "sweep", segment.amplitude_n, period, segment.role),
        number=number,
        direction_name=segment.along,
        unit_vector=_to_tuple(vector),
        band_hz=(segment.from_hz, segment.to_hz),
    )


def _make_multisine_pieces(
    protocol: RecordingProtocol, number: int, segment: MultisineSegment, rate_hz: float
) -> list[RecordingPiece]:
    """A piece for each realisation of a multisine. A multisine does not start at zero, so its fades lie outside the
    evaluated periods."""
    period, fade = round(segment.duration_s * rate_hz), round(protocol.fade_s * rate_hz)
    lines = list_lines_between(segment.from_hz, segment.to_hz, period, rate_hz, odd_only=segment.odd_only)
    vector = None if segment.along == "all" else make_unit_vector(protocol.directions, segment.along)
    tiles = make_multisines(
        lines, period, segment.amplitude_n, 3 if vector is None else 1, segment.realisations, segment.seed
    )
    pieces = []
    for realisation, tile in enumerate(tiles, start=1):
        wave = tile[np.arange(-fade, segment.periods * period + fade) % period]
        forces = apply_fades(wave if vector is None else wave * vector, fade, fade)
        commands, shift = _add_rests(protocol, forces, rate_hz)
        start, stop = shift + fade, shift + fade + segment.periods * period
        pieces.append(
            RecordingPiece(
                commands=commands,
                segment=Segment(start, stop, "multisine", segment.amplitude_n, period, segment.role),
                number=number,
                direction_name=segment.along,
                unit_vector=None if vector is None else _to_tuple(vector),
                band_hz=(segment.from_hz, segment.to_hz),
                realisation=realisation,
            )
        )
    return pieces


def _add_rests(protocol: RecordingProtocol, forces: FloatArray, rate_hz: float) -> tuple[Signal, int]:
    """Commands of a piece, and the index at which `forces`, (n, 3), begin."""
    rest_samples = round(protocol.rest_s * rate_hz)
    samples = np.zeros((len(forces) + 2 * rest_samples, 3))
    samples[rest_samples : rest_samples + len(forces)] = forces
    return Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), rest_samples


def _to_tuple(vector: FloatArray) -> tuple[float, float, float]:
    """A vector, (3,), as a tuple."""
    return float(vector[0]), float(vector[1]), float(vector[2])
