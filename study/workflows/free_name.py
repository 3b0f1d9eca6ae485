"""Check of output names before any work: the files do not exist yet, and their folder does.

Results are never overwritten; a long computation must not fail only when it writes them.
"""

from pathlib import Path

from study.errors import StudyError


def require_free(out: Path, *beside: Path, title: str, kind: str, saved: str = "Nothing was written.") -> None:
    """Raise StudyError if `out` or another path exists, or if the folder of `out` does not.

    beside: further paths that will be written into the same folder. title, saved: of the error. kind: name of the files
    that are never overwritten, in the plural, for the error.
    """
    for path in (out, *beside):
        if path.exists():
            happened = f"{path} exists already, and {kind} are never overwritten."
            raise StudyError(title, happened, "Choose another name with --out.", saved=saved)
    if not out.absolute().parent.is_dir():
        raise StudyError(
            title,
            f"There is no folder {out.parent} to write {out.name} into.",
            "Make the folder first, or choose another name with --out.",
            saved=saved,
        )
