"""The stimulus of a trial or probe in the form that a device plays: a periodic force, repeated until it is released.

The module is separate from `stimulus`, which computes the force, so that devices do not depend on equalizers.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray, Signal


@dataclass(frozen=True, slots=True)
class HeldStimulus:
    """A force that a device repeats until its release: a loop of whole periods, with a fade at either end."""

    loop: Signal
    """(n, 3) in N, axes x, y, z, at the device's rate."""
    fade_in_s: float
    """Duration of the fade-in (s). Not applied to the force of a stimulus with an `onset`. The gain of the virtual
    spring is ramped up over the same time, or over the device's `release_s` if that is longer."""
    fade_out_s: float
    """Duration of the fade-out (s), which begins at the release."""
    fade_shape: str
    """Shape of both fades: "raised_cosine" or "linear"."""
    onset: Signal | None = None
    """(ticks, 3) in N, played once before the loop in place of a fade-in: the transient of an equalized stimulus,
    computed so that the amplitude of the acceleration rises smoothly. None: the loop is faded in."""

    @property
    def onset_then_loop(self) -> FloatArray:
        """(ticks + n, 3) in N: the onset and one loop in sequence; the loop alone where there is no onset."""
        return self.loop.samples if self.onset is None else np.concatenate([self.onset.samples, self.loop.samples])
