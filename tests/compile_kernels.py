"""Compiles what numba has to, into its caches beside the sources, so that tests that run at once find it there."""

import sys
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("equalizer", "analysis", "study")


def kernels() -> list[str]:
    """Modules with compiled functions: with a signature they compile as they are imported, and are kept."""
    files = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    found = [path.relative_to(ROOT).with_suffix("") for path in files if "@njit(" in path.read_text(encoding="utf-8")]
    return [".".join(path.parts) for path in found]


def main() -> None:
    sys.path.insert(0, str(ROOT))
    for name in kernels():
        import_module(name)
    # Its functions have no signatures: they compile for what they are first called with.
    import_module("study.evaluation.challenge.draw_case").draw_case(1, ["coulomb_friction"])


if __name__ == "__main__":
    main()
