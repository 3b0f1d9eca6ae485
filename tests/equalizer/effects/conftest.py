from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def bench(module_at) -> ModuleType:
    """`tests/contracts/effect_bench.py`, invented devices with one effect each."""
    return module_at(Path(__file__).parents[2] / "contracts" / "effect_bench.py")
