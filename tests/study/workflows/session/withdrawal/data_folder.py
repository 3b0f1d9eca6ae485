"""Data folders of several participants, made from the frozen corpus."""

import shutil
from pathlib import Path

from study.store.sessions.archive import SessionFolder
from study.workflows.session.withdraw_participant import plan_withdrawal, withdraw

CORPUS = Path(__file__).resolve().parents[4] / "frozen" / "v0_1" / "study"

UTC = "2026-05-04T09:30:00+00:00"


def copy_session(data: Path, name: str) -> None:
    """The corpus's finished session under another name, with one recording."""
    folder = data / name
    (folder / "recordings").mkdir(parents=True)
    for path in sorted((CORPUS / "P01_001" / "recordings").iterdir())[:1]:
        shutil.copy(path, folder / "recordings")
    for path in ("events.jsonl", "trials.csv", "thresholds.csv", "session.json"):
        text = (CORPUS / "P01_001" / path).read_text()
        (folder / path).write_text(text.replace("P01", name.partition("_")[0]).replace("_001", name[-4:]))


def write_analysis(folder: Path, *subjects: str) -> None:
    (folder / "figures").mkdir(parents=True)
    header, row = (CORPUS / "P01_001" / "thresholds.csv").read_text().splitlines()[:2]
    rows = [row.replace("P01", subject) for subject in subjects]
    (folder / "thresholds.csv").write_text("\n".join([header, *rows, ""]))
    (folder / "report.html").write_text(" ".join(subjects))
    for number, subject in enumerate(subjects):
        (folder / "figures" / f"staircases-{number}-{subject}.svg").write_text("<svg/>")


def erase(data: Path, session: str = "P01_001") -> None:
    withdraw(data, plan_withdrawal(SessionFolder(data / session)), UTC)


def files(folder: Path) -> dict[str, bytes | str]:
    """Of everything below, links as what they say."""
    return {
        str(path.relative_to(folder)): str(path.readlink()) if path.is_symlink() else path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_symlink() or path.is_file()
    }
