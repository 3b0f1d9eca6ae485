"""Detect faults from the spectrum or the values of a single signal, without a model of the device.

Mains hum and white noise in a response are faults where they are clearly stronger than in the clean recordings and, for
hum, in the commands; a quantized command is one where its step is coarser than that of the clean commands. Called by
`reference.compare_with_reference`. Limits are in `analysis.diagnosis.limits`; other numbers are chosen by hand.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.limits import (
    LINE_PROMINENCE,
    MAINS_HZ,
    MAINS_TOLERANCE_HZ,
    NEW_LINE_RATIO,
    NOISE_BAND_RATIO,
    NOISE_INCREASE,
    NOISE_STRETCHES,
    STEP_FACTOR,
)
from equalizer.effects.starts.lattice import confirm_lattice_step, find_lattice_step
from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SignalFault:
    """A fault of the responses or of the commands that is detected without a model."""

    effect: str
    """Name of the effect in `equalizer.plant.effect_vocabulary`."""
    place: Place
    channels: tuple[int, ...]
    """Indices of the channels that have the fault."""
    values: dict[str, float]
    """Parameters of the effect for the channel with the largest fault, by name; amplitudes in the unit of the
    signal."""


def find_hum(faulty: Sequence[Part], clean: Sequence[Part]) -> SignalFault | None:
    """Find mains hum that is clearly stronger in the faulty parts, with the amplitude (unit of the response) and
    frequency (Hz) of its strongest channel; None where there is none."""
    mains_lines = [
        (*mains_line, channel)
        for channel in range(faulty[0].response.shape[1])
        if (mains_line := _find_mains_line(faulty, clean, channel)) is not None
    ]
    if not mains_lines:
        return None
    amplitude, frequency_hz, _ = max(mains_lines)
    channels = tuple(channel for _, _, channel in mains_lines)
    return SignalFault("mains_hum", "sensor", channels, {"amplitude": amplitude, "frequency": frequency_hz})


def find_sensor_noise(faulty: Sequence[Part], clean: Sequence[Part]) -> SignalFault | None:
    """Find white noise that was added to responses, with the rms (unit of the response) of the noisiest channel; None
    where there is none. Added noise is louder in every faulty stretch than in any clean one, and white: its power is
    about the same in the highest eighth of the spectrum as in the eighth above its middle."""
    noisy_channels: list[tuple[float, int]] = []
    for channel in range(faulty[0].response.shape[1]):
        faulty_floors, clean_floors = (
            np.array(
                [
                    _estimate_noise_floors(part.response[:, channel], stretch)
                    for part in parts
                    for stretch in _split_into_stretches(part)
                ]
            )
            for parts in (faulty, clean)
        )
        if not len(faulty_floors) or not len(clean_floors):
            continue
        added_power = np.median(faulty_floors, axis=0) - np.median(clean_floors, axis=0)
        is_louder = bool(np.all(faulty_floors.min(axis=0) > NOISE_INCREASE * clean_floors.max(axis=0)))
        if is_louder and 1 / NOISE_BAND_RATIO < added_power[0] / added_power[1] < NOISE_BAND_RATIO:
            noisy_channels.append((float(np.sqrt(added_power.mean())), channel))
    if not noisy_channels:
        return None
    return SignalFault(
        "sensor_noise", "sensor", tuple(channel for _, channel in noisy_channels), {"rms": max(noisy_channels)[0]}
    )


def find_quantization(faulty: Sequence[Part], clean: Sequence[Part]) -> SignalFault | None:
    """Find the first command whose values are multiples of a coarser step than those of the clean command; None
    where there is none. Commands are not compared unless the clean one has more than twice as many distinct values."""
    for channel in range(faulty[0].command.shape[1]):
        faulty_values, clean_values = (
            np.concatenate([part.command[:, channel] for part in parts]) for parts in (faulty, clean)
        )
        step = find_lattice_step(faulty_values)
        has_many_values = len(np.unique(clean_values)) > 2 * len(np.unique(faulty_values))
        if has_many_values and step is not None and step > STEP_FACTOR * confirm_lattice_step(clean_values, step):
            return SignalFault("force_quantization", "actuator", (channel,), {"step": step})
    return None


def _split_into_stretches(part: Part) -> list[slice]:
    """Split a part into about `NOISE_STRETCHES` stretches of at least 64 samples, so that an eighth of the spectrum has
    at least four lines; stretches with missing samples are left out."""
    stretch_length = max(len(part.response) // NOISE_STRETCHES, 64)
    starts = range(0, len(part.response) - stretch_length + 1, stretch_length)
    return [
        slice(start, start + stretch_length) for start in starts if part.known[start : start + stretch_length].all()
    ]


def _estimate_noise_floors(samples: FloatArray, stretch: slice) -> tuple[float, float]:
    """Estimate the variance of white noise from the median power in the highest eighth of the spectrum, and from that
    in the eighth above its middle (Hann window). samples: (n,)."""
    stretch_samples = samples[stretch]
    window = np.hanning(len(stretch_samples))
    detrended = stretch_samples - np.linspace(stretch_samples[0], stretch_samples[-1], len(stretch_samples))
    power = np.abs(np.fft.rfft(detrended * window)) ** 2 / float(np.sum(window**2))
    eighth = len(power) // 8
    # The median of a power with two degrees of freedom (exponential distribution) is log 2 times its mean.
    highest_variance, middle_variance = (
        float(np.median(power[-k * eighth : (1 - k) * eighth or None])) / np.log(2) for k in (1, 4)
    )
    return highest_variance, middle_variance


def _find_mains_line(faulty: Sequence[Part], clean: Sequence[Part], channel: int) -> tuple[float, float] | None:
    """Find the largest mains line of a response in the longest faulty part: its amplitude (unit of the response) and
    frequency (Hz). None where no line exceeds the spectrum around it, or where the clean recordings or the commands
    have it nearly as strongly. Mains frequencies above 0.4 of the sample rate are not tested."""
    longest = max(faulty, key=lambda part: len(part.response))
    strongest: tuple[float, float] | None = None
    for mains_hz in MAINS_HZ:
        if longest.rate_hz < 2.5 * mains_hz:
            continue
        ratio, amplitude, frequency_hz = _measure_mains_line(longest.response[:, channel], longest.rate_hz, mains_hz)
        clean_ratios = [_measure_mains_line(part.response[:, channel], part.rate_hz, mains_hz)[0] for part in clean]
        command_ratios = [_measure_mains_line(column, longest.rate_hz, mains_hz)[0] for column in longest.command.T]
        if (
            ratio > LINE_PROMINENCE
            and ratio > NEW_LINE_RATIO * max([1.0, *clean_ratios, *command_ratios])
            and (strongest is None or amplitude > strongest[0])
        ):
            strongest = amplitude, frequency_hz
    return strongest


def _measure_mains_line(samples: FloatArray, rate_hz: float, mains_hz: float) -> tuple[float, float, float]:
    """Measure the largest spectral line within `MAINS_TOLERANCE_HZ` (or 1.5 lines) of `mains_hz` (Hann window): the
    ratio of its power to the median power around it, its amplitude (unit of the samples) and its frequency (Hz). The
    median is over lines within 6 Hz, or 24 lines if these are more, without those near the mains frequency. Ratio and
    amplitude are 0 where the spectrum has no line there, or none around it. samples: (n,)."""
    window = np.hanning(len(samples))
    detrended = samples - np.linspace(samples[0], samples[-1], len(samples))
    power = np.abs(np.fft.rfft((detrended - detrended.mean()) * window)) ** 2
    frequency_hz = np.fft.rfftfreq(len(samples), 1 / rate_hz)
    resolution_hz = rate_hz / len(samples)
    line_mask = np.abs(frequency_hz - mains_hz) <= max(MAINS_TOLERANCE_HZ, 1.5 * resolution_hz)
    background_mask = (np.abs(frequency_hz - mains_hz) <= max(6.0, 24 * resolution_hz)) & (
        np.abs(frequency_hz - mains_hz) > max(2 * MAINS_TOLERANCE_HZ, 4 * resolution_hz)
    )
    if not line_mask.any() or not background_mask.any():
        return 0.0, 0.0, mains_hz
    peak_line = int(np.flatnonzero(line_mask)[np.argmax(power[line_mask])])
    median_power = max(float(np.median(power[background_mask])), 1e-300)
    # Parseval over the main lobe of the Hann window, less the noise in it (its mean power is its median over log 2): so
    # the amplitude depends neither on where the tone lies between two lines, nor on the noise.
    main_lobe = power[max(peak_line - 2, 1) : peak_line + 3]
    tone_power = max(float(main_lobe.sum()) - len(main_lobe) * median_power / np.log(2), 0.0)
    amplitude = 2 * float(np.sqrt(tone_power / (len(samples) * float(np.sum(window**2)))))
    return float(power[peak_line]) / median_power, amplitude, float(frequency_hz[peak_line])
