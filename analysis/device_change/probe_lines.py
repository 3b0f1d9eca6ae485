"""A probe's answer line by line: force and acceleration at the lines that drive each axis, and what lies between; and
the force that dry friction would be along its motion.

Friction is Dahl's law (P. R. Dahl, "A solid friction model", 1968), dF/dx = (1 - F sgn v) / x0 for a force of 1 N;
without x0 it is Coulomb's sign of the velocity.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

ComplexArray = npt.NDArray[np.complex128]
IntArray = npt.NDArray[np.int64]

DRIVEN_SHARE = 0.1
"""Least amplitude of a driven line, relative to an axis's strongest: weaker ones are due to rounding and the spring."""

FROM_HZ = 3.0
"""Lower end of the lines at which the acceleration is integrated twice: below it, the result is the sensor's drift. By
hand."""

TO_HZ = 150.0
"""Upper end of the lines that make up the position: above it, it hardly moves. By hand."""

BREAK_AWAYS_M = (2e-6, 8e-6, 2e-5, 5e-5)
"""Lengths over which friction builds up, from almost none to a soft one; the best-fitting one is taken. By
hand."""

PASSES = 3
"""Periods computed until Dahl's force, which remembers its start, repeats: it forgets within a few break-away
lengths."""


@dataclass(frozen=True, slots=True, eq=False)
class ProbeLines:
    """Means over the whole periods of one probe. Spectra are amplitudes: a cosine of 1 N has 1 N."""

    frequency_hz: FloatArray
    """(lines,): of all lines, driven or not, without that of zero."""
    driven: npt.NDArray[np.bool_]
    """(lines, axes)"""
    force_n: ComplexArray
    """(lines, axes): what was sent, spring and damper included."""
    acceleration_mps2: ComplexArray
    """(lines, axes)"""
    position_m: ComplexArray
    """(lines, axes): encoders; NaN where there are none."""


def probe_lines(recording: Recording, period_s: float) -> ProbeLines:
    """Force and acceleration at the lines of a probe. Raises ValueError where less than a period was kept, or samples
    are missing."""
    period = round(period_s * recording.sample_rate_hz)
    decided = recording.command if recording.excitation is None else recording.excitation
    first, last = 0, len(recording)
    if recording.segments:
        first, last = recording.segments[0].start, recording.segments[0].stop
    if last - first > 2 * period:  # the first of many periods holds the transient
        first += period
    excitation, force, acceleration = (
        _mean_spectrum(each.samples[first:last], period) for each in (decided, recording.command, recording.response)
    )
    if not np.isfinite(force).all() or not np.isfinite(acceleration).all():
        raise ValueError("samples of it are missing")
    position = np.full(force.shape, np.nan, dtype=complex)
    if recording.position is not None and recording.position.samples.shape[1] == force.shape[1]:
        position = _mean_spectrum(recording.position.samples[first:last], period)
    size = np.abs(excitation)
    return ProbeLines(
        frequency_hz=np.arange(1, len(force) + 1) / period_s,
        driven=size > DRIVEN_SHARE * size.max(axis=0),
        force_n=force,
        acceleration_mps2=acceleration,
        position_m=position,
    )


MASS_LINES_HZ = (30.0, 60.0)
"""Lines between which the response is nearly that of a mass: friction and springs matter below, the linkage's modes
above."""


def apparent_mass_kg(lines: ProbeLines) -> float:
    """Median of the real part of force over acceleration along each driven axis, on `MASS_LINES_HZ`: a hand on the
    handle adds to it. Raises ValueError where there is no such line, or what comes out is no mass."""
    low_hz, high_hz = MASS_LINES_HZ
    here = (lines.frequency_hz >= low_hz) & (lines.frequency_hz <= high_hz)
    rows, axes = np.nonzero(lines.driven & here[:, None])
    if not len(rows):
        raise ValueError(f"it has no line between {low_hz:g} and {high_hz:g} Hz, which would tell the handle's mass")
    with np.errstate(divide="ignore", invalid="ignore"):  # of a dead sensor
        mass_kg = float(np.median((lines.force_n[rows, axes] / lines.acceleration_mps2[rows, axes]).real))
    if not np.isfinite(mass_kg) or mass_kg <= 0:
        raise ValueError("its acceleration does not follow the force: is the accelerometer right?")
    return mass_kg


def _mean_spectrum(samples: FloatArray, period: int) -> ComplexArray:
    """(lines, axes), without the line of zero and half the rate."""
    whole = len(samples) // period
    if not whole:
        raise ValueError("less than one period of it was kept")
    mean = samples[len(samples) - whole * period :].reshape(whole, period, -1).mean(axis=0)
    spectrum: ComplexArray = (2 / period * np.fft.rfft(mean, axis=0))[1 : period // 2]
    return spectrum


def friction_shapes(probes: tuple[ProbeLines, ...], period: int) -> ComplexArray:
    """(break-aways, probes, lines, axes): spectrum of the force that friction of 1 N along each axis is."""
    position_m = np.stack([_position_m(probe, period) for probe in probes], axis=1)
    step_m = np.diff(position_m, axis=0, append=position_m[:1])
    lengths_m = np.array(BREAK_AWAYS_M)[:, None, None]
    force = np.zeros((len(BREAK_AWAYS_M), *position_m.shape[1:]))
    kept = np.zeros((period, *force.shape))
    for tick in range(PASSES * period):
        way = step_m[tick % period][None]
        # The exact solution over a step of constant direction: it never leaves -1 to 1, however long the step.
        sign = np.sign(way)
        force = np.where(way == 0, force, sign - (sign - force) * np.exp(-np.abs(way) / lengths_m))
        kept[tick % period] = force
    # A step leads to the next sample: half a sample later than the force that it began with.
    spectrum: ComplexArray = 2 / period * np.fft.rfft(kept, axis=0)[1 : period // 2]
    late = np.exp(1j * np.pi * np.arange(1, period // 2) / period)[:, None, None, None]
    shapes: ComplexArray = np.moveaxis(spectrum * late, 0, 2)
    return shapes


def _position_m(probe: ProbeLines, period: int) -> FloatArray:
    """(period, axes): of the encoders, which sit where friction acts; else the acceleration integrated twice."""
    frequency_hz = probe.frequency_hz[:, None]
    if np.isfinite(probe.position_m).all():
        lines = np.where(frequency_hz <= TO_HZ, probe.position_m, 0)
    else:
        inside = (frequency_hz >= FROM_HZ) & (frequency_hz <= TO_HZ)
        lines = np.where(inside, probe.acceleration_mps2 / -((2 * np.pi * frequency_hz) ** 2), 0)
    whole = np.zeros((period // 2 + 1, lines.shape[1]), dtype=complex)
    whole[1 : period // 2] = lines * period / 2
    position_m: FloatArray = np.fft.irfft(whole, period, axis=0)
    return position_m
