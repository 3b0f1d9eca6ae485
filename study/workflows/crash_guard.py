"""Guard for the runs of users: if an effect or a figure crashes, it is left out and reported, and the run continues.

In the project's own tests an environment variable turns the guard off, so that every crash is seen.
"""

import os

from analysis.diagnosis.search.guard import Guard

STRICT = "HAPTEQ_STRICT"
"""Environment variable that turns the guard off, if it is not empty: exceptions then propagate."""


def crash_guard() -> Guard:
    """A new guard, for a single run; see `analysis.diagnosis.search.guard.Guard`."""
    return Guard(enabled=not os.environ.get(STRICT))
