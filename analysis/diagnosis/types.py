"""Type aliases of the diagnosis and the commands that call it: masks, parallel maps, progress and time limits."""

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

Mask = npt.NDArray[np.bool_]
"""Boolean array, usually (n,): True at the samples, or at the lines of a spectrum, that are used."""

Mapper = Callable[..., Iterable[object]]
"""The built-in `map`, or a parallel map with the same arguments; results are in the order of the items."""

Progress = Callable[[str, float], None]
"""Progress callback: called with the current step in words and the completed share of the whole work, 0 to 1."""

TimeBudget = Callable[[], bool]
"""Time limit: called before each step of a search. True = time remains; False ends the search with the best result so
far."""
