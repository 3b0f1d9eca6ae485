"""What `import protocols`, `equalizer`, `analysis` and `study` offer, and what that costs."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

PACKAGES = ("protocols", "equalizer", "analysis", "study")
ROOT = Path(__file__).parents[2]
HEAVY = ("numpy", "scipy", "numba", "pandas", "matplotlib", "h5py", "pydantic", "textual")


@pytest.mark.parametrize("name", PACKAGES)
def test_every_exported_name_is_there_and_described(name):
    package = import_module(name)
    assert package.__all__ == sorted(package.__all__)
    assert set(package.__all__) <= set(dir(package))
    for exported in package.__all__:
        found = getattr(package, exported)
        described = isinstance(found, dict) or (found.__doc__ and not found.__doc__.startswith(f"{found.__name__}("))
        assert described, f"{name}.{exported} says nothing of itself"


@pytest.mark.parametrize("name", PACKAGES)
def test_the_reference_describes_every_exported_name(name):
    page = (ROOT / "docs" / "api" / f"{name}.md").read_text("utf-8")
    homes = [home.replace(":", ".") for home in import_module(name)._HOME.values()]
    assert sorted(re.findall(r"^::: (\S+)$", page, re.MULTILINE)) == sorted(homes)


@pytest.mark.parametrize("name", PACKAGES)
def test_an_import_alone_loads_nothing_heavy(name):
    code = f"import sys, {name}; print(' '.join(m for m in {HEAVY!r} if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize("name", PACKAGES)
def test_a_name_that_is_not_there_is_an_attribute_error(name):
    with pytest.raises(AttributeError, match="nothing_of_the_kind"):
        _ = import_module(name).nothing_of_the_kind
