"""Hand-made facts of a session, for folds driven without any device."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def facts() -> ModuleType:
    """The builders of `test_state.py`."""
    spec = importlib.util.spec_from_file_location("state_facts", Path(__file__).parent / "state" / "test_state.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
