"""Recordings of the synthetic device: axes or multisines one after the other, a second of rest before and after."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def synthetic() -> ModuleType:
    """`synthetic_recordings.py` of this folder."""
    path = Path(__file__).parent / "synthetic_recordings.py"
    spec = importlib.util.spec_from_file_location("synthetic_recordings", path)
    assert spec is not None and spec.loader is not None
    module = sys.modules["synthetic_recordings"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
