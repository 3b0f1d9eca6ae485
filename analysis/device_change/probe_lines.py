"""Spectra of a probe (a short multisine, with or without a hand on the handle): force, acceleration and position at
each spectral line, and the spectrum of dry friction along the probe's motion.

Friction follows Dahl's law (P. R. Dahl, "A solid friction model", 1968) at a level of 1 N,

    dF/dx = (1 - F sgn v) / x0,

x0: break-away length; as x0 goes to 0, F is Coulomb's sgn v. Over a step of constant direction s = sgn v and length
|dx| it has the exact solution F+ = s - (s - F) exp(-|dx| / x0), which is used here.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray, FloatArray

LEAST_DRIVEN_SHARE = 0.1
"""Amplitude above which a line counts as driven, relative to the strongest of its axis. Chosen by hand."""

LOWEST_INTEGRATED_HZ = 3.0
"""Lower end of the lines at which the acceleration is integrated twice: below it, the result is the sensor's drift.
Chosen by hand."""

HIGHEST_POSITION_HZ = 150.0
"""Upper end of the lines that make up the position: above it, the handle hardly moves. Chosen by hand."""

BREAK_AWAY_LENGTHS_M = tuple(np.geomspace(2e-6, 5e-5, 8).tolist())
"""Break-away lengths x0 of Dahl's law that are tried (m), from a stiff contact to a soft one. Too large a length gives
too large a level of friction, too small a length too small a level: by some 10 % where lengths differ by a factor of
1.6, by 40 % for a factor of 2.5. Chosen by hand."""

LEAST_RESPONSE_MPS2 = 1e-9
"""Amplitude of a driven line's acceleration up to which a sensor counts as not responding, m/s²: the spectrum of a
constant reading has only rounding, far below; the noise of an accelerometer lies far above. Chosen by hand."""

INTEGRATED_PERIODS = 3
"""Number of periods over which Dahl's law is integrated; the last is used. Its initial state decays within a few
break-away lengths of motion, so that the force is then periodic. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class ProbeLines:
    """Spectra of the mean period of one probe, as amplitudes: a cosine of 1 N has 1 N."""

    frequency_hz: FloatArray
    """(lines,): lines from 1 / period to below half the sample rate, driven or not."""
    driven: npt.NDArray[np.bool_]
    """(lines, axes): whether the probe's multisine drives the axis at the line."""
    force_n: ComplexArray
    """(lines, axes): the command in N, including the forces of the virtual spring and damper."""
    acceleration_mps2: ComplexArray
    """(lines, axes): as measured, in m/s^2."""
    position_m: ComplexArray
    """(lines, axes): from the encoders, in m; NaN without encoders, with another number of them than of axes, or with
    missing samples."""


def compute_probe_lines(recording: Recording, period_s: float) -> ProbeLines:
    """Compute the spectra of the mean period of a probe; of its first segment where the recording has segments.
    period_s: period of the multisine. Raises ValueError where less than a period was recorded, samples of command,
    excitation or response are missing, or the acceleration along a driven axis does not respond."""
    period_samples = round(period_s * recording.sample_rate_hz)
    # With a virtual spring, the command also holds the spring's force, which would count as driven.
    excitation_signal = recording.command if recording.excitation is None else recording.excitation
    start, stop = 0, len(recording)
    if recording.segments:
        start, stop = recording.segments[0].start, recording.segments[0].stop
    if stop - start > 2 * period_samples:  # of more than two periods, the first holds the transient
        start += period_samples
    excitation, force_n, acceleration_mps2 = (
        _compute_mean_spectrum(signal.samples[start:stop], period_samples)
        for signal in (excitation_signal, recording.command, recording.response)
    )
    if not all(np.isfinite(spectrum).all() for spectrum in (excitation, force_n, acceleration_mps2)):
        raise ValueError("the recording has missing samples")
    position_m = np.full(force_n.shape, np.nan, dtype=complex)
    if recording.position is not None and recording.position.samples.shape[1] == force_n.shape[1]:
        position_m = _compute_mean_spectrum(recording.position.samples[start:stop], period_samples)
    excitation_amplitude = np.abs(excitation)
    driven = excitation_amplitude > LEAST_DRIVEN_SHARE * excitation_amplitude.max(axis=0)
    if (np.abs(acceleration_mps2[driven]) <= LEAST_RESPONSE_MPS2).any():
        raise ValueError("its acceleration does not follow the force: check the accelerometer and its cable")
    return ProbeLines(
        frequency_hz=np.arange(1, len(force_n) + 1) / period_s,
        driven=driven,
        force_n=force_n,
        acceleration_mps2=acceleration_mps2,
        position_m=position_m,
    )


MASS_BAND_HZ = (30.0, 60.0)
"""Band in Hz in which the response is nearly that of a mass: friction and springs matter below it, the modes of the
linkage above it. Chosen by hand."""
MAX_MASS_KG = 1e3
"""Largest mass that an estimate gives, far above that of a hand on a handle; a sensor that is nearly silent shows a
larger one. Chosen by hand."""


def estimate_apparent_mass_kg(probe: ProbeLines) -> float:
    """Estimate the apparent mass in kg: median of the real part of force over acceleration, over the driven lines in
    `MASS_BAND_HZ`, on the axes that they drive. A hand on the handle adds to it. Raises ValueError where there is no
    such line, or the median is not a positive number up to `MAX_MASS_KG`."""
    low_hz, high_hz = MASS_BAND_HZ
    in_band = (probe.frequency_hz >= low_hz) & (probe.frequency_hz <= high_hz)
    line_indices, axis_indices = np.nonzero(probe.driven & in_band[:, None])
    if not len(line_indices):
        raise ValueError(
            f"it has no driven line between {low_hz:g} and {high_hz:g} Hz, from which the handle's mass is estimated"
        )
    with np.errstate(divide="ignore", invalid="ignore"):  # a disconnected sensor reads zero
        mass_kg = float(
            np.median(
                (probe.force_n[line_indices, axis_indices] / probe.acceleration_mps2[line_indices, axis_indices]).real
            )
        )
    if not 0 < mass_kg <= MAX_MASS_KG:
        raise ValueError("its acceleration does not follow the force: check the accelerometer and its cable")
    return mass_kg


def _compute_mean_spectrum(samples: FloatArray, period_samples: int) -> ComplexArray:
    """Compute (lines, axes): spectrum of the mean period, over all whole periods up to the end, on lines 1 to
    period_samples // 2 - 1. samples: (n, axes). Raises ValueError where they are shorter than a period."""
    period_count = len(samples) // period_samples
    if not period_count:
        raise ValueError("less than one whole period was recorded")
    mean_period = (
        samples[len(samples) - period_count * period_samples :].reshape(period_count, period_samples, -1).mean(axis=0)
    )
    spectrum: ComplexArray = (2 / period_samples * np.fft.rfft(mean_period, axis=0))[1 : period_samples // 2]
    return spectrum


def compute_friction_spectra(probes: tuple[ProbeLines, ...], period_samples: int) -> ComplexArray:
    """Compute (lengths, probes, lines, axes): spectrum of dry friction of 1 N along each axis of each probe's motion,
    for every length in `BREAK_AWAY_LENGTHS_M`.

    Sample k is the friction at the end of the step from k to k + 1. It thus belongs to the command k, which is held
    over that step and whose acceleration is read at its end; so commands and friction may be added line by line.
    """
    position_m = np.stack([_estimate_position_m(probe, period_samples) for probe in probes], axis=1)
    displacements_m = np.diff(position_m, axis=0, append=position_m[:1])
    lengths_m = np.array(BREAK_AWAY_LENGTHS_M)[:, None, None]
    friction_n = np.zeros((len(BREAK_AWAY_LENGTHS_M), *position_m.shape[1:]))
    last_period_n = np.zeros((period_samples, *friction_n.shape))
    for sample_index in range(INTEGRATED_PERIODS * period_samples):
        displacement_m = displacements_m[sample_index % period_samples][None]
        direction = np.sign(displacement_m)
        # Exact over a step of constant direction, so that the force never leaves -1 to 1, however long the step.
        moving_friction_n = direction - (direction - friction_n) * np.exp(-np.abs(displacement_m) / lengths_m)
        friction_n = np.where(displacement_m == 0, friction_n, moving_friction_n)
        last_period_n[sample_index % period_samples] = friction_n
    spectrum: ComplexArray = 2 / period_samples * np.fft.rfft(last_period_n, axis=0)[1 : period_samples // 2]
    friction_spectra: ComplexArray = np.moveaxis(spectrum, 0, 2)
    return friction_spectra


def _estimate_position_m(probe: ProbeLines, period_samples: int) -> FloatArray:
    """Estimate the position in m over one period, (period_samples, axes): from the encoders, which are where friction
    acts; where any of their lines is NaN, the acceleration integrated twice, from `LOWEST_INTEGRATED_HZ` up."""
    frequency_hz = probe.frequency_hz[:, None]
    if np.isfinite(probe.position_m).all():
        position_lines_m = np.where(frequency_hz <= HIGHEST_POSITION_HZ, probe.position_m, 0)
    else:
        in_band = (frequency_hz >= LOWEST_INTEGRATED_HZ) & (frequency_hz <= HIGHEST_POSITION_HZ)
        position_lines_m = np.where(in_band, probe.acceleration_mps2 / -((2 * np.pi * frequency_hz) ** 2), 0)
    spectrum = np.zeros((period_samples // 2 + 1, position_lines_m.shape[1]), dtype=complex)
    spectrum[1 : period_samples // 2] = position_lines_m * period_samples / 2
    position_m: FloatArray = np.fft.irfft(spectrum, period_samples, axis=0)
    return position_m
