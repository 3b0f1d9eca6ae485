"""Check of output names before any work: the files do not exist yet, and their folder does.

Results are never overwritten; a long computation must not fail only when it writes them.
"""

from pathlib import Path

from study.errors import StudyError


def require_free(
    out_path: Path, *further_paths: Path, title: str, kind: str, saved: str = "Nothing was written."
) -> None:
    """Raise StudyError if `out_path` or another path exists, or if the folder of `out_path` does not.

    further_paths: paths that will be written into the same folder. title, saved: of the error. kind: name of the files
    that are never overwritten, in the plural, for the error.
    """
    for path in (out_path, *further_paths):
        if path.exists():
            explanation = f"{path} exists already, and {kind} are never overwritten."
            raise StudyError(title, explanation, "Choose another name with --out.", saved=saved)
    if not out_path.absolute().parent.is_dir():
        raise StudyError(
            title,
            f"There is no folder {out_path.parent} to write {out_path.name} into.",
            "Make the folder first, or choose another name with --out.",
            saved=saved,
        )
