"""Whether a crash of one effect or one recording ends a run: not for people; for the project's own tests it does."""

import os

from analysis.diagnosis.search.guard import Guard

STRICT = "HAPTEQ_STRICT"
"""Set in the environment, a crash is an error."""


def crash_guard() -> Guard:
    """A new one, for one run."""
    return Guard(on=not os.environ.get(STRICT))
