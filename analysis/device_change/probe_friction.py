"""The shape of a friction force over one period of a measured motion: Dahl's law with a force of 1 N.

Source: P. R. Dahl, "A solid friction model", 1968; dF/dx = (1 - F sgn v) / x0. Without x0 it is Coulomb's sign of v.
"""

import numpy as np

from analysis.device_change.probe_lines import ComplexArray, ProbeLines
from equalizer.signals.signal import FloatArray

FROM_HZ = 3.0
"""Integrated twice, what the accelerometer says below is drift."""

TO_HZ = 150.0

BREAK_AWAYS_M = (2e-6, 8e-6, 2e-5, 5e-5)
"""Lengths over which friction builds up: from as good as none to a soft one. Which holds, the data say."""

PASSES = 3
"""Periods gone through until the force repeats."""


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
