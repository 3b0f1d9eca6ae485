"""Exception guard of a diagnosis: an effect or a figure that raises is left out and reported, and the run continues.

The project's own tests turn the guard off by an environment variable, so that exceptions propagate.
"""

import os

from analysis.diagnosis.search.guard import Guard

STRICT_VARIABLE = "HAPTEQ_STRICT"
"""Name of the environment variable that turns the guard off where it is set and not empty."""


def make_crash_guard() -> Guard:
    """Make a guard for a single run."""
    return Guard(enabled=not os.environ.get(STRICT_VARIABLE))
