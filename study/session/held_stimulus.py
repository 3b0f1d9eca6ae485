"""What a device is asked to hold. Apart from how it is made, so that a device knows nothing of equalizers."""

from dataclasses import dataclass

from equalizer.signals.signal import Signal


@dataclass(frozen=True, slots=True)
class HeldStimulus:
    """A force to be held: one loop of whole periods, repeated, with a fade at either end."""

    loop: Signal
    """(n, 3) in N, axes x, y, z, at the device's rate."""
    fade_in_s: float
    fade_out_s: float
    fade_shape: str
    """"raised_cosine" or "linear"."""
