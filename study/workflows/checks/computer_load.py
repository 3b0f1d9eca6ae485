"""Load average of this computer: a busy computer delays the control loop of the device."""

import os


def get_load_per_processor() -> float | None:
    """Get the load average of the last minute divided by the number of processors that this program may use; 1: all are
    busy. None where the system has no load average (Windows)."""
    try:
        load_average = os.getloadavg()[0]
    except (AttributeError, OSError):
        return None
    processor_count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return load_average / max(processor_count or 1, 1)
