"""How busy this computer is, as its system counts it."""

import os


def load_per_processor() -> float | None:
    """Processes that ran or waited for a processor, averaged over the last minute, for each processor that this program
    may use. None where the system does not tell."""
    try:
        load = os.getloadavg()[0]
    except (AttributeError, OSError):  # not on every system
        return None
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return load / max(processors or 1, 1)
