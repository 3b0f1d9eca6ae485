"""Axes with physics of their own, and what the balance of forces says of them."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import Signal


@pytest.fixture(scope="session")
def axis_module(module_at) -> ModuleType:
    """`invented_axis.py`. Imported late: it compiles."""
    return module_at(Path(__file__).parent / "invented_axis.py")


@pytest.fixture(scope="session")
def find_balance():
    """Of a recording, one per axis."""
    from analysis.diagnosis.balance.balances import find_balances
    from analysis.diagnosis.search.time_budget import grant_time

    return lambda recording, without=(): find_balances([recording], frozenset(without), grant_time)


@pytest.fixture(scope="session")
def record_samples():
    """force (n, m) and response (n, p) of one quantity, without an axis behind them."""

    def recording(force, response, rate_hz, quantity="position", hold=Hold.BAND_LIMITED, unit=None, **beside):
        unit = unit or {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}[quantity]
        channels = tuple("xyz"[: np.shape(response)[1]])
        return Recording(
            "invented",
            Signal(force, rate_hz, "force", "N", tuple(f"f{k}" for k in "xyz"[: np.shape(force)[1]])),
            Signal(response, rate_hz, quantity, unit, channels),
            hold=hold,
            **beside,
        )

    return recording
