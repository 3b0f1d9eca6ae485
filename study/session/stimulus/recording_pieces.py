"""Pieces of a recording: the segments of a protocol as commands, a piece for each sinusoid, sweep or multisine
realisation (`make_pieces`).

    rest | fade in and settling | evaluated part | fade out | rest

A sweep has no settling and no fade-out, and is evaluated from its beginning. An analysis uses only the evaluated part:
whole periods at constant amplitude (except the first period of a sweep, which is faded in where others follow, and
contains the transient).
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
from study.errors import WrongUseError
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
        """Return the piece with the excitation scaled to another peak (N)."""
        samples = self.commands.samples * (amplitude_n / self.segment.amplitude)
        return replace(
            self,
            commands=replace(self.commands, samples=samples),
            segment=replace(self.segment, amplitude=amplitude_n),
        )


def make_pieces(protocol: RecordingProtocol, sample_rate_hz: float) -> tuple[RecordingPiece, ...]:
    """Make all pieces in the order of the protocol's segments, the whole sequence as often as the protocol repeats it.
    sample_rate_hz: sample rate of the device. Raises WrongUseError for a segment that cannot be made at this rate."""
    sequence: list[RecordingPiece] = []
    for number, segment in enumerate(protocol.segments, start=1):
        try:
            if round(protocol.fade_s * sample_rate_hz) == 0:
                raise ValueError(f"the fade of {protocol.fade_s:g} s is no more than half a tick: the force would jump")
            sequence += _make_segment_pieces(protocol, number, segment, sample_rate_hz)
        except ValueError as error:
            raise WrongUseError(
                "This protocol cannot be recorded",
                f"segments[{number}] of '{protocol.name}' at {sample_rate_hz:g} samples per second: {error}.",
                "Change its frequencies, its duration or fade_s, or take a device of a higher rate.",
                saved="Nothing moved.",
            ) from error
    return tuple(sequence) * protocol.repeats


def _make_segment_pieces(
    protocol: RecordingProtocol,
    number: int,
    segment: SineSegment | SweepSegment | MultisineSegment,
    sample_rate_hz: float,
) -> list[RecordingPiece]:
    """Make the pieces of a segment, each played once. Raises ValueError where it cannot be made at this rate."""
    match segment:
        case SineSegment():
            return [
                _make_sine_piece(protocol, number, segment, frequency_hz, sample_rate_hz)
                for frequency_hz in segment.frequencies_hz
            ]
        case SweepSegment():
            return [_make_sweep_piece(protocol, number, segment, sample_rate_hz)]
        case MultisineSegment():
            return _make_multisine_pieces(protocol, number, segment, sample_rate_hz)


def make_unit_vector(directions: TestDirections, axis_name: str) -> FloatArray:
    """Make the unit vector, (3,), of a device axis (x, y, z) or of a test direction (direction_1, direction_2)."""
    if axis_name in ("x", "y", "z"):
        axis: FloatArray = np.eye(3)["xyz".index(axis_name)]
        return axis
    return compute_direction_vector(directions, int(axis_name.removeprefix("direction_")))


def _make_sine_piece(
    protocol: RecordingProtocol, number: int, segment: SineSegment, frequency_hz: float, sample_rate_hz: float
) -> RecordingPiece:
    """Make the piece of a sinusoid. The evaluated part is a whole number, at least one, of loops: the shortest whole
    periods that are a whole number of samples (`count_loop_samples`). Settling and fades lie outside. Raises ValueError
    from half the sample rate on, where the samples of a sinusoid are all zero."""
    if 2 * frequency_hz >= sample_rate_hz:
        raise ValueError(f"a sinusoid needs a frequency below half the rate, not {frequency_hz:g} Hz")
    period_samples = count_loop_samples(frequency_hz, sample_rate_hz)
    fade_samples = round(protocol.fade_s * sample_rate_hz)
    settle_samples = max(fade_samples, round(segment.settle_s * sample_rate_hz))
    evaluated_samples = max(1, round(segment.duration_s * sample_rate_hz) // period_samples) * period_samples
    wave = make_sine(
        frequency_hz, segment.amplitude_n, settle_samples + evaluated_samples + fade_samples, sample_rate_hz
    )
    unit_vector = make_unit_vector(protocol.directions, segment.along)
    commands, rest_samples = _add_rests(
        protocol, apply_fades(wave, fade_samples, fade_samples)[:, None] * unit_vector, sample_rate_hz
    )
    start = rest_samples + settle_samples
    return RecordingPiece(
        commands=commands,
        segment=Segment(start, start + evaluated_samples, "sine", segment.amplitude_n, period_samples, segment.role),
        number=number,
        direction_name=segment.along,
        unit_vector=_to_tuple(unit_vector),
        frequency_hz=frequency_hz,
    )


def _make_sweep_piece(
    protocol: RecordingProtocol, number: int, segment: SweepSegment, sample_rate_hz: float
) -> RecordingPiece:
    """Make the piece of a sweep. With several periods it is faded in during the first, which contains the transient;
    a period contains whole cycles and so ends near zero: no fade-out is needed."""
    period_samples = round(segment.duration_s * sample_rate_hz)
    wave = np.tile(
        make_log_sweep(segment.from_hz, segment.to_hz, segment.amplitude_n, period_samples, sample_rate_hz),
        segment.periods,
    )
    unit_vector = make_unit_vector(protocol.directions, segment.along)
    fade_in_samples = round(protocol.fade_s * sample_rate_hz) if segment.periods > 1 else 0
    commands, start = _add_rests(
        protocol, apply_fades(wave, min(fade_in_samples, period_samples), 0)[:, None] * unit_vector, sample_rate_hz
    )
    return RecordingPiece(
        commands=commands,
        segment=Segment(start, start + len(wave), "sweep", segment.amplitude_n, period_samples, segment.role),
        number=number,
        direction_name=segment.along,
        unit_vector=_to_tuple(unit_vector),
        band_hz=(segment.from_hz, segment.to_hz),
    )


def _make_multisine_pieces(
    protocol: RecordingProtocol, number: int, segment: MultisineSegment, sample_rate_hz: float
) -> list[RecordingPiece]:
    """Make a piece for each realisation of a multisine. A multisine need not start at zero; therefore fades lie outside
    the evaluated periods."""
    period_samples, fade_samples = round(segment.duration_s * sample_rate_hz), round(protocol.fade_s * sample_rate_hz)
    harmonic_numbers = list_lines_between(
        segment.from_hz, segment.to_hz, period_samples, sample_rate_hz, odd_only=segment.odd_only
    )
    unit_vector = None if segment.along == "all" else make_unit_vector(protocol.directions, segment.along)
    period_waves = make_multisines(
        harmonic_numbers,
        period_samples,
        segment.amplitude_n,
        3 if unit_vector is None else 1,
        segment.realisations,
        segment.seed,
    )
    pieces = []
    for realisation, period_wave in enumerate(period_waves, start=1):
        wave = period_wave[np.arange(-fade_samples, segment.periods * period_samples + fade_samples) % period_samples]
        forces = apply_fades(wave if unit_vector is None else wave * unit_vector, fade_samples, fade_samples)
        commands, rest_samples = _add_rests(protocol, forces, sample_rate_hz)
        start, stop = rest_samples + fade_samples, rest_samples + fade_samples + segment.periods * period_samples
        pieces.append(
            RecordingPiece(
                commands=commands,
                segment=Segment(start, stop, "multisine", segment.amplitude_n, period_samples, segment.role),
                number=number,
                direction_name=segment.along,
                unit_vector=None if unit_vector is None else _to_tuple(unit_vector),
                band_hz=(segment.from_hz, segment.to_hz),
                realisation=realisation,
            )
        )
    return pieces


def _add_rests(protocol: RecordingProtocol, forces: FloatArray, sample_rate_hz: float) -> tuple[Signal, int]:
    """Add a rest before and after `forces`, (n, 3), N. Returns the commands of the piece and the index at which the
    forces begin."""
    rest_samples = round(protocol.rest_s * sample_rate_hz)
    samples = np.zeros((len(forces) + 2 * rest_samples, 3))
    samples[rest_samples : rest_samples + len(forces)] = forces
    return Signal(samples, sample_rate_hz, "force", "N", ("fx", "fy", "fz")), rest_samples


def _to_tuple(vector: FloatArray) -> tuple[float, float, float]:
    """Convert a vector, (3,), to a tuple."""
    return float(vector[0]), float(vector[1]), float(vector[2])
