"""Types that all folders of the diagnosis share: masks of samples, parallel maps, progress and time limits."""

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

Mask = npt.NDArray[np.bool_]
"""(n,): True at the samples, or at the lines of a spectrum, that count."""

Mapper = Callable[..., Iterable[object]]
"""The built-in `map`, or a function with its arguments that works in parallel; results keep the order of the items."""

Progress = Callable[[str, float], None]
"""Called with the current step in words, and the share of the whole work that is done, 0 to 1."""

TimeBudget = Callable[[], bool]
"""Time limit: called before each piece of a search. True = time is left; False ends the search, which keeps what it has
found."""
