"""Load of this computer."""

import os


def load_per_processor() -> float | None:
    """Load average of the last minute divided by the number of processors that this program may use; None if
    unknown."""
    try:
        load = os.getloadavg()[0]
    except (AttributeError, OSError):  # not on every system
        return None
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return load / max(processors or 1, 1)
