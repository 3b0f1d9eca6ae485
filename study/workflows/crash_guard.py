"""Whether a crash of one effect or recording ends a run: not for users, but in the project's own tests."""

import os

from analysis.diagnosis.search.guard import Guard

STRICT = "HAPTEQ_STRICT"
"""If this environment variable is set, a crash is an error."""


def crash_guard() -> Guard:
    """A new guard, for one run."""
    return Guard(on=not os.environ.get(STRICT))
