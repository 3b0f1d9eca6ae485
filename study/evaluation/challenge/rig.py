"""How large a bench is: which of its axes are driven and read, how long, and how much unknown physics is in it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rig:
    """The other axes only move along: their numbers are known."""

    axes: tuple[int, ...] = (0, 1, 2)
    """Driven and read."""
    period: int = 2000
    """Of a multisine, samples; sweeps and slow sines are longer or shorter with it."""
    periods: int = 4
    extras: float = 0.0
    """How much the device has of everything that real devices have and no label names; 1 = hardly seen."""

    steps: int = 20
    """Of the bench's integrator in a sample. With few of them its error shows: at 20 it reads like a sensor of one axis
    that is off by two in a thousand."""
    loud_n: float = 0.0
    """Level of a further stretch of the test, all axes at once; 0 = none."""

    def along(self, samples: int) -> int:
        """So many samples of the whole rig's drive in this one's."""
        return samples * self.period // 2000


WHOLE = Rig()
