"""Recordings of the synthetic device: axes or multisines one after the other, a second of rest before and after."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def synthetic() -> ModuleType:
    """`synthetic_recordings.py` of this folder."""
    return _beside("synthetic_recordings")


@pytest.fixture(scope="session")
def measuring() -> ModuleType:
    """`measured_lines.py` of this folder."""
    return _beside("measured_lines")


def _beside(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parent / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
