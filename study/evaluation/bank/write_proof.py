"""Write the results of a blind test of the diagnosis, in which effects are concealed in simulated recordings.

`write_proof` writes into the folder of the test: `proof.json` (all figures), `proof.csv` (one row per case) and
`report.html`. `write_table` writes the figures and the misses as small CSV tables that can be kept under version
control. Both state the commit and the digests of the code that answered, so that figures can be traced to it.
"""

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
"""Name and version of the format of `proof.json`."""
DOCUMENT, TABLE, PAGE = "proof.json", "proof.csv", "report.html"
"""Names of the files in the folder of the test."""


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
    """Names of the concealed effects. This and the other texts with several entries: separated by blanks."""
    at: str
    """Axis of each concealed effect; "all" for an effect on all axes."""
    strength: str
    """Strength of each concealed effect, 0 to 1."""
    adds: float
    """Rms change of the readings by the concealed effects, over the rms noise, in the worst channel."""
    detectable: bool
    verdict: str
    named: str
    """Names of the effects that the diagnosis names."""
    named_at: str
    """Axis of each named effect; "all" for an effect on all axes."""
    probability: str
    """Probability of each named effect, as the diagnosis states it."""
    returned: str
    """The named effects and the rivals that the recordings do not distinguish from these."""
    main_error: float | None
    """Relative error of the effect's main parameter; only where the right effect of a single one is named."""
    retuned: float | None
    """Rms error on held-out samples over the rms noise, in the worst channel, with the model re-tuned."""
    after: float | None
    """The same with the named effects."""
    seconds: float | None
    """Duration of the diagnosis, s."""
    miss: bool
    """Whether the case counts as a miss in the score."""


@dataclass(frozen=True, slots=True)
class FigureRow:
    """A figure as a row of the small table: value, 95 % confidence interval from `low` to `high`, and the number `of`
    cases or values from which the figure was computed."""

    figure: str
    value: float | None
    low: float | None
    high: float | None
    of: int


def write_proof(done: BlindTest) -> None:
    """Write document, table, pictures and page into the test's folder, replacing earlier files. Raises StudyError."""
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
    """Write the figures to `path` and the misses to `misses_table(path)`. Comment lines at the head of the first table
    state the cases, the code and the seal of the labels. Raises StudyError."""
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
    """Path of the table of misses, in the folder of the table of figures."""
    return path.with_name(f"{path.stem}-misses{path.suffix}")


def read_answering_commit(done: BlindTest) -> str:
    """The commit in an earlier `proof.json` by the same code; else the current commit, where the current code gave the
    answers; else "unknown: …"."""
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
    """Commit of the running checkout, with "+" appended if files of its analysis or equalizer are changed; "unknown"
    where git gives none."""
    root = Path(analysis.diagnosis.__path__[0]).parent
    try:
        at = _git(root, "rev-parse", "HEAD")
        return at + ("+" if _git(root, "status", "--porcelain", "--untracked-files=no", ".", "../equalizer") else "")
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def _git(folder: Path, *words: str) -> str:
    """Output of a git command. Raises OSError, CalledProcessError; TimeoutExpired after 60 s."""
    done = subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=True, timeout=60)
    return done.stdout.strip()


def _row(outcome: Outcome, miss: bool) -> CaseRow:
    """The row of a case. miss: whether the case counts as a miss."""
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
    """The value with four decimals; None for NaN."""
    return None if value is None or value != value else round(value, 4)
