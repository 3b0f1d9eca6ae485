"""Write the results of a blind test: a JSON document, a table with one row per case, a page, and a small table to
keep."""

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import analysis.diagnosis
from analysis.evaluation.blind_test.outcome import Outcome
from analysis.evaluation.blind_test.score import main_error
from analysis.figures.blind_test_pictures import blind_test_pictures
from analysis.reports.blind_test_report import BlindTestFacts, render_blind_test_report
from study.evaluation.bank.answer_cases import engine_digest
from study.evaluation.bank.proof_summary import remarks
from study.evaluation.bank.prove import BlindTest
from study.local_clock import local_now
from study.store.disk.csv_rows import rows_to_csv
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import command_line, gather_provenance, versions
from study.store.disk.text_file import write_text
from study.workflows.picture_files import write_pictures

FORMAT, VERSION = "hapteq-proof", 1
DOCUMENT, TABLE, PAGE = "proof.json", "proof.csv", "report.html"


@dataclass(frozen=True, slots=True)
class CaseRow:
    """A case of the bank as a row of proof.csv and of the table of misses: what was concealed, and what the diagnosis
    answered."""

    number: int
    seed: int
    kind: str
    bank: str
    axes: str
    model: str
    concealed: str
    at: str
    strength: str
    adds: float
    detectable: bool
    verdict: str
    named: str
    named_at: str
    probability: str
    returned: str
    main_error: float | None
    retuned: float | None
    after: float | None
    seconds: float | None
    miss: bool


@dataclass(frozen=True, slots=True)
class FigureRow:
    """A figure as a row of the table to keep: value, interval from `low` to `high`, and the number of items it was
    measured on."""

    figure: str
    value: float | None
    low: float | None
    high: float | None
    of: int


def write_proof(done: BlindTest) -> None:
    """Write document, table and page, replacing earlier ones. Raises StudyError."""
    folder, at = done.folder.path, read_answering_commit(done)
    score = done.score
    document = {
        "seed": done.plan.seed,
        "cases": done.plan.cases,
        "brief": done.plan.brief,
        "left_out": done.left_out,
        "seal": done.seal,
        "engines": list(done.engines),
        "engines_beside": list(done.beside),
        "commit": at,
        "figures": [asdict(figure) for figure in score.figures],
        "calibration": asdict(score.calibration),
        "followed": [asdict(each) for each in done.followed],
        "controls": [asdict(control) for control in done.controls],
        "misses": [miss.number for miss in score.misses],
    }
    write_json(folder / DOCUMENT, FORMAT, VERSION, document, gather_provenance(), overwrite=True)
    rows = [_row(outcome, outcome in score.misses) for outcome in done.outcomes]
    write_text(folder / TABLE, rows_to_csv(rows, CaseRow), overwrite=True)
    pictures = blind_test_pictures(done.outcomes, score.calibration)
    write_pictures(folder / "figures", pictures)
    facts = BlindTestFacts(seeds(done), done.seal, at, done.engines, tuple(remarks(done)), done.controls, done.followed)
    page = render_blind_test_report(
        done.outcomes, score, pictures, facts, {"command": " ".join(command_line(sys.argv))}, local_now()
    )
    write_text(folder / PAGE, page, overwrite=True)


def write_table(path: Path, done: BlindTest) -> None:
    """Write the figures and what they were measured on as a small table that can be kept beside the code. Raises
    StudyError."""
    calibration = done.score.calibration
    figures = [
        FigureRow(figure.name, figure.value, figure.low, figure.high, figure.of) for figure in done.score.figures
    ]
    named = sum(part.of for part in calibration.bins)
    figures.append(FigureRow("expected calibration error", calibration.error, calibration.low, calibration.high, named))
    failed = [control.name for control in done.controls if not control.held]
    held = f"{len(done.controls) - len(failed)} of {len(done.controls)} held" if done.controls else "not asked"
    lines = [
        f"# {len(done.outcomes)} cases, seeds {seeds(done)}",
        f"# commit {read_answering_commit(done)}, code of the diagnosis {' '.join(done.engines)}",
        f"# follow-ups and controls by code {' '.join(done.beside) or 'none'}",
        f"# seal of the labels {done.seal}",
        f"# versions {json.dumps(versions())}",
        f"# controls {', not '.join((held, *failed))}",
    ]
    write_text(path, "\n".join(lines) + "\n" + rows_to_csv(figures, FigureRow), overwrite=True)
    misses = [_row(miss, True) for miss in done.score.misses]
    write_text(misses_table(path), rows_to_csv(misses, CaseRow), overwrite=True)


def misses_table(path: Path) -> Path:
    """Path of the table of misses, beside the table of figures."""
    return path.with_name(f"{path.stem}-misses{path.suffix}")


def read_answering_commit(done: BlindTest) -> str:
    """The commit recorded when the answers were first written; the current one where the same code gave them."""
    document = done.folder.path / DOCUMENT
    if document.exists():
        before = read_json(document, FORMAT, VERSION)
        if before.get("engines") == list(done.engines) and isinstance(before.get("commit"), str):
            return str(before["commit"])
    return commit() if done.engines in ((), (engine_digest(),)) else "unknown: the code has changed since"


def seeds(done: BlindTest) -> str:
    """First and last seed of the cases, as text: "1 to 500"."""
    return f"{done.plan.seed} to {done.plan.seed + done.plan.cases - 1}"


def commit() -> str:
    """Commit of the running checkout, "+" if its files are changed; "unknown" outside a checkout."""
    root = Path(analysis.diagnosis.__path__[0]).parent
    try:
        at = _git(root, "rev-parse", "HEAD")
        return at + ("+" if _git(root, "status", "--porcelain", "--untracked-files=no", ".", "../equalizer") else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(folder: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=True, timeout=60)
    return done.stdout.strip()


def _row(outcome: Outcome, miss: bool) -> CaseRow:
    known = outcome.kind == "single" and outcome.right and bool(outcome.concealed)
    return CaseRow(
        outcome.number, outcome.seed, outcome.kind, outcome.bank, " ".join(outcome.axes), outcome.model,
        " ".join(outcome.names),
        " ".join(c.axis or "all" for c in outcome.concealed),
        " ".join(f"{value:.3f}" for value in outcome.strengths),
        round(outcome.adds, 4), outcome.detectable, outcome.verdict,
        " ".join(outcome.named_names),
        " ".join(effect.axis or "all" for effect in outcome.named),
        " ".join(f"{effect.probability:.3f}" for effect in outcome.named),
        " ".join(outcome.returned),
        _short(main_error(outcome.concealed[0], outcome.named[0]) if known else None),
        _short(outcome.left("retuned")), _short(outcome.left("after")), _short(outcome.seconds), miss,
    )  # fmt: skip


def _short(value: float | None) -> float | None:
    return None if value is None or value != value else round(value, 4)
