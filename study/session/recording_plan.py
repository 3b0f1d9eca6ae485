"""A recording protocol turned into what is played: one piece per sinusoid or sweep, rests included."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.excitation import faded, log_sweep, sine
from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray, Signal
from protocols.apparatus import TestDirections
from protocols.recording_protocol import RecordingProtocol, SineSegment, SweepSegment
from study.session.stimulus import direction_vector, loop_length


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One excitation with a rest before and after it."""

    commands: Signal
    """(n, 3) in N."""
    segment: Segment
    """The part that counts, in samples of `commands`."""
    frequency_hz: float | None
    """Of a sinusoid; None for a sweep."""
    along: str
    unit_vector: tuple[float, float, float]


def pieces(protocol: RecordingProtocol, sample_rate_hz: float) -> tuple[Piece, ...]:
    """Everything the protocol plays, in order."""
    once: list[Piece] = []
    for segment in protocol.segments:
        if isinstance(segment, SineSegment):
            once += [_sine_piece(protocol, segment, f, sample_rate_hz) for f in segment.frequencies_hz]
        else:
            once.append(_sweep_piece(protocol, segment, sample_rate_hz))
    return tuple(once) * protocol.repeats


def unit_vector(directions: TestDirections, along: str) -> FloatArray:
    """(3,): a device axis, or a test direction."""
    if along in ("x", "y", "z"):
        axis: FloatArray = np.eye(3)["xyz".index(along)]
        return axis
    return direction_vector(directions, int(along.removeprefix("direction_")))


def _sine_piece(protocol: RecordingProtocol, segment: SineSegment, frequency_hz: float, rate_hz: float) -> Piece:
    """The counted part is whole loops; settling before it and the fades lie outside."""
    period = loop_length(frequency_hz, rate_hz)
    fade = round(protocol.fade_s * rate_hz)
    settle = max(fade, round(segment.settle_s * rate_hz))
    counted = max(1, round(segment.duration_s * rate_hz) // period) * period
    wave = sine(frequency_hz, segment.amplitude_n, settle + counted + fade, rate_hz)
    return _piece(
        protocol,
        faded(wave, fade, fade),
        counted=Segment(settle, settle + counted, "sine", segment.amplitude_n, period),
        along=segment.along,
        frequency_hz=frequency_hz,
        rate_hz=rate_hz,
    )


def _sweep_piece(protocol: RecordingProtocol, segment: SweepSegment, rate_hz: float) -> Piece:
    """Faded in during the first period, which is there for the transient; every period ends at zero by itself."""
    period = round(segment.duration_s * rate_hz)
    wave = np.tile(log_sweep(segment.from_hz, segment.to_hz, segment.amplitude_n, period, rate_hz), segment.periods)
    return _piece(
        protocol,
        faded(wave, round(protocol.fade_s * rate_hz) if segment.periods > 1 else 0, 0),
        counted=Segment(0, len(wave), "sweep", segment.amplitude_n, period),
        along=segment.along,
        frequency_hz=None,
        rate_hz=rate_hz,
    )


def _piece(
    protocol: RecordingProtocol,
    wave: FloatArray,
    counted: Segment,
    along: str,
    frequency_hz: float | None,
    rate_hz: float,
) -> Piece:
    rest = round(protocol.rest_s * rate_hz)
    vector = unit_vector(protocol.directions, along)
    samples = np.zeros((len(wave) + 2 * rest, 3))
    samples[rest : rest + len(wave)] = wave[:, None] * vector
    return Piece(
        commands=Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")),
        segment=Segment(counted.start + rest, counted.stop + rest, counted.kind, counted.amplitude, counted.period),
        frequency_hz=frequency_hz,
        along=along,
        unit_vector=(float(vector[0]), float(vector[1]), float(vector[2])),
    )
