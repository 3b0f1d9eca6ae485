"""Mains hum: a steady tone in the response, at mains frequency or another, that no command contains.

    y = x + A sin(2 pi f t + phase)        A in the unit of the response, f in Hz

Starting values come from spectral lines of the residual that are strong, steady over the recording, and not commanded.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import regression_coefficients
from equalizer.signals.signal import FloatArray

MAINS_HZ = (45.0, 65.0)
"""Range of mains frequencies, 50 and 60 Hz with a margin, that is searched first."""
PEAK_RATIO = 12.0
"""Least ratio of a tone's power to the median power of the lines around it."""
NEIGHBOURS_HZ = 3.0
"""Half-width (Hz) of the band around a line over which that median is taken."""
ROUNDS = 4
"""Gauss-Newton steps for the frequency."""
BLOCKS, STEADY = 12, 0.8
"""Number of blocks of the recording that are compared in amplitude and phase, and least constancy (0 to 1) of a
tone."""
COMMANDED = 0.1
"""Half the amplitude of a tone in a command, over the command's rms, above which the tone counts as commanded."""
MAINLY, MOST_TIMES = 0.5, 9
"""The same ratio for a tone with half of a command's power, and highest order up to which harmonics of such a tone
count as commanded."""


def _add_tone(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    time_s = np.arange(len(response)) / sample_rate_hz
    read = response.copy()
    tone = values["amplitude"] * np.sin(2 * np.pi * values["frequency"] * time_s + values.get("phase", 0.0))
    read[:, channels] += tone[:, None]
    return read


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Starting values: the line that all channels share, between 45 and 65 Hz and anywhere, with this channel's
    amplitude and phase."""
    residual = (evidence.response - evidence.predicted) * evidence.used[:, None]
    power = np.sum(np.abs(np.fft.rfft(residual / evidence.noise, axis=0)) ** 2, axis=1)
    lines_hz = np.fft.rfftfreq(len(residual), 1 / evidence.sample_rate_hz)
    tones: list[Values] = []
    for low, high in (MAINS_HZ, (1.0, 0.49 * evidence.sample_rate_hz)):
        band_lines = np.flatnonzero((lines_hz >= low) & (lines_hz <= high))
        if not len(band_lines):
            continue
        peak_line = int(band_lines[np.argmax(power[band_lines])])
        neighbours = np.abs(lines_hz - lines_hz[peak_line]) < NEIGHBOURS_HZ
        if power[peak_line] < PEAK_RATIO * float(np.median(power[neighbours])):
            continue
        tone = _fit_tone(residual[:, channel], evidence, float(lines_hz[peak_line]))
        steady = _steadiness(residual[:, _loudest_channel(residual, evidence, peak_line)], evidence, tone["frequency"])
        if (
            steady > STEADY
            and not _is_commanded(evidence, tone["frequency"])
            and not any(abs(tone["frequency"] - accepted["frequency"]) < lines_hz[1] for accepted in tones)
        ):
            tones.append(tone)
    return tuple(tones)


def _is_commanded(evidence: Evidence, frequency_hz: float) -> bool:
    """Whether a command contains the tone steadily, or consists mainly of a tone of which this is a harmonic."""
    return _commands_hold_tone(evidence, frequency_hz, COMMANDED) or any(
        _commands_hold_tone(evidence, frequency_hz / times, MAINLY) for times in range(2, MOST_TIMES + 1)
    )


def _commands_hold_tone(evidence: Evidence, frequency_hz: float, least_share: float) -> bool:
    """Whether a command contains the tone steadily. least_share: lower limit of half the tone's amplitude over the
    command's rms."""
    phasor = np.exp(-2j * np.pi * frequency_hz * np.arange(len(evidence.command)) / evidence.sample_rate_hz)
    shares = (
        np.abs(phasor @ evidence.command)
        / len(phasor)
        / np.maximum(np.sqrt(np.mean(evidence.command**2, axis=0)), 1e-300)
    )
    steady = [_steadiness(command, evidence, frequency_hz) for command in evidence.command.T]
    return any(
        amplitude > least_share and constancy > STEADY for amplitude, constancy in zip(shares, steady, strict=True)
    )


def _loudest_channel(residual: FloatArray, evidence: Evidence, line: int) -> int:
    """The channel in which a spectral line (index of the FFT) is strongest relative to the noise."""
    turn = np.exp(-2j * np.pi * line * np.arange(len(residual)) / len(residual))
    return int(np.argmax(np.abs(turn @ residual) / evidence.noise))


def _steadiness(residual: FloatArray, evidence: Evidence, frequency_hz: float) -> float:
    """Constancy of a tone's amplitude and phase over the blocks, 0 to 1: magnitude of the mean phasor over the rms of
    the blocks' phasors."""
    demodulated = np.exp(-2j * np.pi * frequency_hz * np.arange(len(residual)) / evidence.sample_rate_hz) * residual
    sums = np.array([part.sum() for part in np.array_split(demodulated, BLOCKS)])
    counts = np.array([part.sum() for part in np.array_split(evidence.used, BLOCKS)])
    block_phasors = sums[counts > 0] / counts[counts > 0]
    size = float(np.sqrt(np.mean(np.abs(block_phasors) ** 2)))
    return float(np.abs(block_phasors.mean())) / size if size > 0 else 0.0


def _fit_tone(residual: FloatArray, evidence: Evidence, frequency_hz: float) -> Values:
    """Amplitude, frequency and phase by Gauss-Newton iteration: linear least squares for the amplitudes of cosine and
    sine, then a frequency correction from the derivative of the tone, limited to 0.3 lines per iteration."""
    time_s = np.arange(len(residual)) / evidence.sample_rate_hz
    # Time counts from the middle of the recording, where estimates of frequency and phase are uncorrelated.
    middle = float(time_s.mean())
    cosine = sine = 0.0
    for _ in range(ROUNDS):
        angle = 2 * np.pi * frequency_hz * (time_s - middle)
        angle_per_hz = 2 * np.pi * (time_s - middle)
        waves = np.column_stack([np.cos(angle), np.sin(angle)])
        cosine, sine = regression_coefficients(residual, waves, evidence.used).tolist()
        size = cosine**2 + sine**2
        if size == 0:
            break
        slope = angle_per_hz * (sine * waves[:, 0] - cosine * waves[:, 1])
        correction = regression_coefficients(residual - waves @ [cosine, sine], slope[:, None], evidence.used)[0]
        frequency_hz += float(np.clip(correction, -0.3 / time_s[-1], 0.3 / time_s[-1]))
    phase = math.atan2(cosine, sine) - 2 * np.pi * frequency_hz * middle
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
    starts=_starts,
    of_time=True,
    sites=("each", "one"),
)
