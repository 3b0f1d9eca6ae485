"""Mains hum: a steady tone in the response, at mains frequency or another, that no command contains.

    y = x + A sin(2 pi f t + phase)        A in the unit of the response, f in Hz, phase in rad

Starting values come from spectral lines of the residual that are strong, steady over the recording, and not commanded.
An entry of `catalogue`.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import fit_coefficients
from equalizer.signals.signal import FloatArray

MAINS_BAND_HZ = (45.0, 65.0)
"""Band (Hz) of mains frequencies, 50 and 60 Hz with a margin, that is searched first."""
LEAST_PEAK_RATIO = 12.0
"""Least ratio of a tone's power to the median power of the lines around it. Chosen, as are the constants below."""
NEIGHBOURHOOD_HZ = 3.0
"""Half-width (Hz) of the band around a line over which that median is taken."""
FREQUENCY_STEPS = 4
"""Largest number of Gauss-Newton steps for the frequency."""
BLOCK_COUNT, LEAST_STEADINESS = 12, 0.8
"""Number of blocks of the recording that are compared in amplitude and phase, and least steadiness (0 to 1) of a
tone."""
COMMANDED_RATIO = 0.1
"""Half a steady tone's amplitude in a command, over the command's rms, above which the tone counts as commanded."""
DOMINANT_RATIO, HIGHEST_HARMONIC = 0.5, 9
"""That ratio for a tone with half of a command's power, and highest order up to which harmonics of such a tone
count as commanded."""


def _add_tone(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """Add the tone to these channels of the response (n, p): `OnResponse.change` of this effect."""
    time_s = np.arange(len(response)) / sample_rate_hz
    response_with_tone = response.copy()
    tone = values["amplitude"] * np.sin(2 * np.pi * values["frequency"] * time_s + values.get("phase", 0.0))
    response_with_tone[:, channels] += tone[:, None]
    return response_with_tone


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the strongest line of the residual, summed over all channels, in `MAINS_BAND_HZ` and from 1 Hz to 0.49 of
    the sample rate (chosen: just below half of it), with this channel's amplitude and phase. A line that does not stand
    out, is not steady or is commanded is left out, and so is the second tone if it is closer to the first than the
    spacing of the lines."""
    residual = (evidence.response - evidence.predicted) * evidence.used[:, None]
    power = np.sum(np.abs(np.fft.rfft(residual / evidence.noise, axis=0)) ** 2, axis=1)
    lines_hz = np.fft.rfftfreq(len(residual), 1 / evidence.sample_rate_hz)
    tones: list[Values] = []
    for low_hz, high_hz in (MAINS_BAND_HZ, (1.0, 0.49 * evidence.sample_rate_hz)):
        band_lines = np.flatnonzero((lines_hz >= low_hz) & (lines_hz <= high_hz))
        if not len(band_lines):
            continue
        peak_line = int(band_lines[np.argmax(power[band_lines])])
        is_neighbour = np.abs(lines_hz - lines_hz[peak_line]) < NEIGHBOURHOOD_HZ
        if power[peak_line] < LEAST_PEAK_RATIO * float(np.median(power[is_neighbour])):
            continue
        tone = _fit_tone(residual[:, channel], evidence, float(lines_hz[peak_line]))
        steadiness = _compute_steadiness(
            residual[:, _find_strongest_channel(residual, evidence, peak_line)], evidence, tone["frequency"]
        )
        if (
            steadiness > LEAST_STEADINESS
            and not _is_commanded(evidence, tone["frequency"])
            and not any(abs(tone["frequency"] - accepted_tone["frequency"]) < lines_hz[1] for accepted_tone in tones)
        ):
            tones.append(tone)
    return tuple(tones)


def _is_commanded(evidence: Evidence, frequency_hz: float) -> bool:
    """Whether a command contains the tone steadily, or consists mainly of a tone of which this is a harmonic."""
    return _has_commanded_tone(evidence, frequency_hz, COMMANDED_RATIO) or any(
        _has_commanded_tone(evidence, frequency_hz / harmonic, DOMINANT_RATIO)
        for harmonic in range(2, HIGHEST_HARMONIC + 1)
    )


def _has_commanded_tone(evidence: Evidence, frequency_hz: float, least_ratio: float) -> bool:
    """Whether a command contains the tone steadily. least_ratio: lower limit of half the tone's amplitude over
    the command's rms."""
    demodulator = np.exp(-2j * np.pi * frequency_hz * np.arange(len(evidence.command)) / evidence.sample_rate_hz)
    amplitude_ratios = (
        np.abs(demodulator @ evidence.command)
        / len(demodulator)
        / np.maximum(np.sqrt(np.mean(evidence.command**2, axis=0)), 1e-300)
    )
    command_steadinesses = [_compute_steadiness(command, evidence, frequency_hz) for command in evidence.command.T]
    return any(
        ratio > least_ratio and command_steadiness > LEAST_STEADINESS
        for ratio, command_steadiness in zip(amplitude_ratios, command_steadinesses, strict=True)
    )


def _find_strongest_channel(residual: FloatArray, evidence: Evidence, line: int) -> int:
    """Find the channel in which a spectral line (index of the FFT) is strongest relative to the noise."""
    demodulator = np.exp(-2j * np.pi * line * np.arange(len(residual)) / len(residual))
    return int(np.argmax(np.abs(demodulator @ residual) / evidence.noise))


def _compute_steadiness(samples: FloatArray, evidence: Evidence, frequency_hz: float) -> float:
    """Compute the constancy of a tone's amplitude and phase over the blocks, 0 to 1: magnitude of the mean phasor over
    the rms of the blocks' phasors, of samples with `evidence.used` = 1. samples: (n,), of one channel."""
    demodulated = np.exp(-2j * np.pi * frequency_hz * np.arange(len(samples)) / evidence.sample_rate_hz) * samples
    block_sums = np.array([block.sum() for block in np.array_split(demodulated * evidence.used, BLOCK_COUNT)])
    block_counts = np.array([block.sum() for block in np.array_split(evidence.used, BLOCK_COUNT)])
    block_phasors = block_sums[block_counts > 0] / block_counts[block_counts > 0]
    rms_phasor = float(np.sqrt(np.mean(np.abs(block_phasors) ** 2)))
    return float(np.abs(block_phasors.mean())) / rms_phasor if rms_phasor > 0 else 0.0


def _fit_tone(residual: FloatArray, evidence: Evidence, frequency_hz: float) -> Values:
    """Fit amplitude, frequency and phase by Gauss-Newton iteration: linear least squares for the amplitudes of cosine
    and sine, then a frequency correction from the derivative of the tone, limited to 0.3 lines per iteration."""
    time_s = np.arange(len(residual)) / evidence.sample_rate_hz
    # Time counts from the middle of the recording, where estimates of frequency and phase are uncorrelated.
    middle_s = float(time_s.mean())
    cosine = sine = 0.0
    for _ in range(FREQUENCY_STEPS):
        angle = 2 * np.pi * frequency_hz * (time_s - middle_s)
        angle_per_hz = 2 * np.pi * (time_s - middle_s)
        waves = np.column_stack([np.cos(angle), np.sin(angle)])
        cosine, sine = fit_coefficients(residual, waves, evidence.used).tolist()
        squared_amplitude = cosine**2 + sine**2
        if squared_amplitude == 0:
            break
        change_per_hz = angle_per_hz * (sine * waves[:, 0] - cosine * waves[:, 1])
        correction = fit_coefficients(residual - waves @ [cosine, sine], change_per_hz[:, None], evidence.used)[0]
        frequency_hz += float(np.clip(correction, -0.3 / time_s[-1], 0.3 / time_s[-1]))
    phase = math.atan2(cosine, sine) - 2 * np.pi * frequency_hz * middle_s
    return {
        "amplitude": math.hypot(cosine, sine),
        "frequency": frequency_hz,
        "phase": (phase + np.pi) % (2 * np.pi) - np.pi,
    }


EFFECT = Effect(
    name="mains_hum",
    equation="y = x + amplitude sin(2 pi frequency t + phase)",
    source="IEC 61000-4-30: frequency of the mains",
    signature="the whole response contains a tone that was not commanded, at rest as in motion, while the position "
    "agrees",
    parameters=(
        Parameter("amplitude", 1e-12, 1e9, none=0.0),
        Parameter("frequency", 0.1, 1e5, none=None, scale="linear", step=1e-4),
        Parameter("phase", -20.0, 20.0, none=None, scale="linear", step=0.02),
    ),
    action=OnResponse(_add_tone, stage=2),
    starts=_find_starting_values,
    of_time=True,
    sites=("each", "one"),
)
