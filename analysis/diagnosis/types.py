"""Types that all folders of the diagnosis share."""

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

Mask = npt.NDArray[np.bool_]
"""Mask of the samples, or of the lines of a spectrum, that count."""

Mapper = Callable[..., Iterable[object]]
"""`map`, or a function that works in parallel and keeps the order."""

Progress = Callable[[str, float], None]
"""Called with what is being done, and the share of the whole work that is done."""

TimeBudget = Callable[[], bool]
"""Time limit: called before each piece of a search; False ends it, and keeps what was found until then."""
