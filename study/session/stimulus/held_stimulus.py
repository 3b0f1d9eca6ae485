"""The stimulus in the form that a device plays: separate from how it is computed, so that devices do not depend on
equalizers."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray, Signal


@dataclass(frozen=True, slots=True)
class HeldStimulus:
    """A force to be played: one loop of whole periods, repeated, with a fade at either end."""

    loop: Signal
    """(n, 3) in N, axes x, y, z, at the device's rate."""
    fade_in_s: float
    fade_out_s: float
    fade_shape: str
    """"raised_cosine" or "linear"."""
    onset: Signal | None = None
    """(ticks, 3) in N: played once before the loop, for a stimulus that has an onset of its own instead of a
    fade-in."""

    @property
    def played_once_then_loop(self) -> FloatArray:
        """Onset and loop in sequence, (ticks + n, 3), N."""
        return self.loop.samples if self.onset is None else np.concatenate([self.onset.samples, self.loop.samples])
