"""Size of a bench: driven axes, length of the recording, amount of unlabelled physics."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rig:
    """The other axes move passively: their parameters are known."""

    axes: tuple[int, ...] = (0, 1, 2)
    """Driven and read axes."""
    period: int = 2000
    """Period of a multisine (samples); sweeps and slow sines scale with it."""
    periods: int = 4
    extras: float = 0.0
    """Factor of the unlabelled effects of real devices; 1 = barely visible."""

    steps: int = 20
    """Integration steps per sample. At 20 the integration error looks like a sensor gain error of 0.2 % on one axis."""
    loud_n: float = 0.0
    """Level (N) of an additional test stretch with all axes at once; 0 = none."""

    def along(self, samples: int) -> int:
        """A duration (samples) of the whole rig's drive, scaled to this period."""
        return samples * self.period // 2000


WHOLE = Rig()
"""Three axes, four periods of 2000 samples, no unlabelled effects."""
