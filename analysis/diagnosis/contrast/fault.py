"""A fault as something that can be undone: what would have been recorded without it, of a given size."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.contrast.taken import Taken
from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.signal import FloatArray

Undo = Callable[[Taken], Taken]


Told = Callable[[FloatArray, float], FloatArray]
"""Of columns (n, k) that tell a command, at a rate."""


Unit = Callable[[int], float]
"""Of every how many samples are kept."""
Numbers = Callable[[FloatArray], dict[str, float]]


EVERY = -1
"""Site of a fault that all channels have."""


@dataclass(frozen=True, slots=True, eq=False)
class Variant:
    """A fault with its nonlinear numbers. Its size multiplies the change that each step of undoing makes."""

    undo: tuple[Undo, ...]
    """One per size, each with a size of 1."""
    values: Numbers
    """Numbers of the fault from its sizes (steps,)."""
    least: float = -np.inf
    most: float = np.inf
    """Of each size: about 1 where undoing is not linear in it."""
    unit: Unit = lambda step: 1.0
    """What is told of a faulty sensor changes by this factor: else a gain that makes every error small would win."""
    told: Told | None = None
    """What the recorded command would be told to be, where that is known from what is told without the fault. Undoing
    a gain or a lag of the command instead would make errors small that are no errors of the fault's."""


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    effect: str
    """A name of the vocabulary, or a new one written like them."""
    place: Place
    axis: str
    site: int
    variants: tuple[Variant, ...]
    simpler: tuple[str, ...] = ()
    """Faults that it holds as special cases."""
    varies: bool = False
    """In the course of a recording: stretches of a faulty one differ by it, too."""


def sized(name: str, of_one: float = 1.0) -> Numbers:
    """A number in proportion to the only size."""
    return lambda sizes: {name: of_one * float(sizes[0])}
