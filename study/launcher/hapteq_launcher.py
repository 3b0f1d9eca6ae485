"""Start hapteq after checking that its four packages are not hidden by other files of the same name.

The names of the packages are generic. A foreign `analysis.py` or `study.py` on the import path would be imported
instead, and the program would fail with a confusing error. This module has a unique name, so that it can report the
problem. The console script `hapteq` and `python -m study` call `main`.
"""

import importlib.util
import sys
from pathlib import Path

PACKAGES = ("study", "analysis", "equalizer", "protocols")
"""The four packages of hapteq."""


def find_home_folder() -> Path | None:
    """Find the first folder on the import path that contains all four packages; None without such a folder."""
    for entry in sys.path:
        folder = Path(entry or ".").resolve()
        if all((folder / name / "__init__.py").is_file() for name in PACKAGES):
            return folder
    return None


def find_foreign_packages() -> list[Path]:
    """Find the files that would be imported under the name of one of the packages without belonging to hapteq."""
    home_folder = find_home_folder()
    foreign_paths = []
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        origin = Path(spec.origin).resolve() if spec is not None and spec.origin else None
        if origin is not None and (home_folder is None or origin != home_folder / name / "__init__.py"):
            foreign_paths.append(origin)
    return foreign_paths


def main() -> int:
    """Run the command line of hapteq. Returns its exit code; 1 where files of another program would be
    imported in place of a package of hapteq."""
    foreign_paths = find_foreign_packages()
    if foreign_paths:
        paths_text = ", ".join(str(path) for path in foreign_paths)
        sys.stderr.write(
            f"Another program's files hide those of hapteq: {paths_text}.\n"
            "Nothing was started. Rename them, or start hapteq without their folder on PYTHONPATH.\n"
        )
        return 1
    from study.cli.main import main as run_command_line

    return run_command_line()
