"""Recordings of the synthetic device: axes or multisines one after the other, a second of rest before and after."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def synthetic(module_at: Callable[[Path], ModuleType]) -> ModuleType:
    """`synthetic_recordings.py` of this folder."""
    return module_at(Path(__file__).parent / "synthetic_recordings.py")


@pytest.fixture(scope="session")
def measuring(module_at: Callable[[Path], ModuleType]) -> ModuleType:
    """`measured_lines.py` of this folder."""
    return module_at(Path(__file__).parent / "measured_lines.py")
