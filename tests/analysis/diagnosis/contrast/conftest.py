"""A rig that is compared with itself as it was."""

from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def rig(module_at) -> ModuleType:
    """`changed_rig.py`."""
    return module_at(Path(__file__).parent / "changed_rig.py")
