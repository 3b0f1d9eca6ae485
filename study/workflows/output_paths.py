"""Check the output paths of a command before its computation or recording: the files must not exist, their folder must.

Such results are not overwritten, and a long computation must not fail only when it writes them.
"""

import os
from pathlib import Path

from study.errors import StudyError


def require_new_outputs(
    out_path: Path, *further_paths: Path, title: str, kind: str, saved: str = "Nothing was written."
) -> None:
    """Raise StudyError where `out_path` or one of `further_paths` exists, or where the folder of `out_path` does not.

    further_paths: further files of the same folder. title, saved: texts of the error. kind: what the files are, in the
    plural, for the error.
    """
    for path in (out_path, *further_paths):
        if os.path.lexists(path):  # a dangling link, too, is a name that is taken
            explanation = f"{path} exists already, and {kind} are never overwritten."
            raise StudyError(title, explanation, "Choose another name with --out.", saved=saved)
    if not out_path.absolute().parent.is_dir():
        raise StudyError(
            title,
            f"There is no folder {out_path.parent} to write {out_path.name} into.",
            "Make the folder first, or choose another name with --out.",
            saved=saved,
        )
