"""Check before any work that an output name is free and its folder exists."""

from pathlib import Path

from study.errors import StudyError


def require_free(out: Path, *beside: Path, title: str, kind: str, saved: str = "Nothing was written.") -> None:
    """Raise StudyError unless `out` is free. `beside`: what else is written into the same folder. title: what fails
    otherwise. kind: what is never overwritten, in the plural."""
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
