"""Pieces of a recording: the segments of a protocol as commands, a piece for each sinusoid, sweep or multisine
realisation.

    rest | fade in and settling | evaluated part | fade out | rest

An analysis uses only the evaluated part: whole periods at constant amplitude (the first period of a sweep contains its
transient). Each piece is played by itself (`workflows/recording/play_pieces`), and again with less force where the
accelerometer clipped (`Piece.at`).
"""

from dataclasses import dataclass, replace

import numpy as np

from equalizer.signals.excitation import apply_fades, log_sweep, sine
from equalizer.signals.multisine import lines_between, multisines
from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray, Signal
from protocols.definition.apparatus import TestDirections
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import MultisineSegment, SineSegment, SweepSegment
from study.session.stimulus.stimulus import direction_vector, loop_length


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One excitation with a rest before and after it."""

    commands: Signal
    """(n, 3) in N."""
    segment: Segment
    """The evaluated part, in samples of `commands`."""
    number: int
    """Number of its segment in the protocol, from 1."""
    along: str
    """Axis or test direction of the force: x, y, z, direction_1, direction_2, or all (three axes at once)."""
    unit_vector: tuple[float, float, float] | None
    """Unit vector of the force; None for all axes at once."""
    frequency_hz: float | None = None
    """Frequency of a sinusoid; None for a sweep or a multisine."""
    band_hz: tuple[float, float] | None = None
    """Lowest and highest frequency of a sweep or a multisine; None for a sinusoid."""
    realisation: int = 1
    """Number of the realisation of a multisine's phases, from 1."""

    def at(self, amplitude_n: float) -> "Piece":
        """The same excitation, scaled to another peak (N)."""
        samples = self.commands.samples * (amplitude_n / self.segment.amplitude)
        return replace(
            self,
            commands=replace(self.commands, samples=samples),
            segment=replace(self.segment, amplitude=amplitude_n),
        )


def pieces(protocol: RecordingProtocol, sample_rate_hz: float) -> tuple[Piece, ...]:
    """All pieces in the order of the protocol's segments, the whole sequence as often as the protocol repeats it.
    sample_rate_hz: sample rate of the device."""
    once: list[Piece] = []
    for number, segment in enumerate(protocol.segments, start=1):
        match segment:
            case SineSegment():
                once += [_sine_piece(protocol, number, segment, f, sample_rate_hz) for f in segment.frequencies_hz]
            case SweepSegment():
                once.append(_sweep_piece(protocol, number, segment, sample_rate_hz))
            case MultisineSegment():
                once += _multisine_pieces(protocol, number, segment, sample_rate_hz)
    return tuple(once) * protocol.repeats


def unit_vector(directions: TestDirections, along: str) -> FloatArray:
    """Unit vector (3,) of a device axis or of a test direction."""
    if along in ("x", "y", "z"):
        axis: FloatArray = np.eye(3)["xyz".index(along)]
        return axis
    return direction_vector(directions, int(along.removeprefix("direction_")))


def _sine_piece(
    protocol: RecordingProtocol, number: int, segment: SineSegment, frequency_hz: float, rate_hz: float
) -> Piece:
    """A sinusoid. The evaluated part is a whole number of loops of whole periods; settling and fades lie outside."""
    period = loop_length(frequency_hz, rate_hz)
    fade = round(protocol.fade_s * rate_hz)
    settle = max(fade, round(segment.settle_s * rate_hz))
    counted = max(1, round(segment.duration_s * rate_hz) // period) * period
    wave = sine(frequency_hz, segment.amplitude_n, settle + counted + fade, rate_hz)
    vector = unit_vector(protocol.directions, segment.along)
    commands, shift = _with_rests(protocol, apply_fades(wave, fade, fade)[:, None] * vector, rate_hz)
    start = shift + settle
    return Piece(
        commands=commands,
        segment=Segment(start, start + counted, "sine", segment.amplitude_n, period, segment.role),
        number=number,
        along=segment.along,
        unit_vector=_triple(vector),
        frequency_hz=frequency_hz,
    )


def _sweep_piece(protocol: RecordingProtocol, number: int, segment: SweepSegment, rate_hz: float) -> Piece:
    """A sweep. With several periods it is faded in during the first, which contains the transient; every period ends at
    zero, so that no fade-out is needed."""
    period = round(segment.duration_s * rate_hz)
    wave = np.tile(log_sweep(segment.from_hz, segment.to_hz, segment.amplitude_n, period, rate_hz), segment.periods)
    vector = unit_vector(protocol.directions, segment.along)
    fade_in = round(protocol.fade_s * rate_hz) if segment.periods > 1 else 0
    commands, start = _with_rests(protocol, apply_fades(wave, min(fade_in, period), 0)[:, None] * vector, rate_hz)
    return Piece(
        commands=commands,
        segment=Segment(start, start + len(wave), "sweep", segment.amplitude_n, period, segment.role),
        number=number,
        along=segment.along,
        unit_vector=_triple(vector),
        band_hz=(segment.from_hz, segment.to_hz),
    )


def _multisine_pieces(
    protocol: RecordingProtocol, number: int, segment: MultisineSegment, rate_hz: float
) -> list[Piece]:
    """A piece for each realisation of a multisine. A multisine does not start at zero, so its fades lie outside the
    evaluated periods."""
    period, fade = round(segment.duration_s * rate_hz), round(protocol.fade_s * rate_hz)
    lines = lines_between(segment.from_hz, segment.to_hz, period, rate_hz, odd_only=segment.odd_only)
    vector = None if segment.along == "all" else unit_vector(protocol.directions, segment.along)
    tiles = multisines(
        lines, period, segment.amplitude_n, 3 if vector is None else 1, segment.realisations, segment.seed
    )
    found = []
    for realisation, tile in enumerate(tiles, start=1):
        wave = tile[np.arange(-fade, segment.periods * period + fade) % period]
        forces = apply_fades(wave if vector is None else wave * vector, fade, fade)
        commands, shift = _with_rests(protocol, forces, rate_hz)
        start, stop = shift + fade, shift + fade + segment.periods * period
        found.append(
            Piece(
                commands=commands,
                segment=Segment(start, stop, "multisine", segment.amplitude_n, period, segment.role),
                number=number,
                along=segment.along,
                unit_vector=None if vector is None else _triple(vector),
                band_hz=(segment.from_hz, segment.to_hz),
                realisation=realisation,
            )
        )
    return found


def _with_rests(protocol: RecordingProtocol, forces: FloatArray, rate_hz: float) -> tuple[Signal, int]:
    """Commands of a piece, and the index at which `forces`, (n, 3), begin."""
    rest = round(protocol.rest_s * rate_hz)
    samples = np.zeros((len(forces) + 2 * rest, 3))
    samples[rest : rest + len(forces)] = forces
    return Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), rest


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
