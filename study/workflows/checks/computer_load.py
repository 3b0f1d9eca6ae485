"""Load average of this computer, one of the checks before a sitting: a busy computer delays the device's loop."""

import os


def load_per_processor() -> float | None:
    """Load average of the last minute divided by the number of processors that this program may use: 1 = all are busy.
    None where the system states no load average."""
    try:
        load = os.getloadavg()[0]
    except (AttributeError, OSError):  # Windows has no load average
        return None
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return load / max(processors or 1, 1)
