"""Write the results of a blind test of the diagnosis, in which effects are concealed in simulated recordings.

`write_proof` writes into the folder of the test: `proof.json` (all figures), `proof.csv` (one row per case),
`report.html`, and its pictures in figures/. A figure is a number, such as the share of correct answers. `write_table`
writes the figures and the misses as small CSV tables that can be kept under version control. Both state the commit and
the digests of the code that answered, so that figures can be traced to it."""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import analysis.diagnosis
from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate
from analysis.evaluation.blind_test.outcome import Outcome
from analysis.evaluation.blind_test.score import compute_main_error
from analysis.figures.blind_test_pictures import make_blind_test_pictures
from analysis.reports.blind_test_report import BlindTestMetadata, render_blind_test_report
from study.evaluation.bank.answer_cases import compute_engine_digest
from study.evaluation.bank.proof_summary import list_remarks
from study.evaluation.bank.prove import BlindTest
from study.local_clock import format_local_now
from study.store.disk.csv_rows import Row, format_csv_table
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import anonymise_arguments, gather_provenance, list_versions
from study.store.disk.text_file import write_text
from study.workflows.picture_files import write_pictures

FORMAT, VERSION = "hapteq-proof", 1
"""Name and version of the format of `proof.json`."""
DOCUMENT, TABLE, PAGE = "proof.json", "proof.csv", "report.html"
"""Names of the three files in the folder of the test: all figures, a row per case, and the page."""


@dataclass(frozen=True, slots=True)
class CaseRow:
    """A case of the bank as a row of proof.csv and of the table of misses: what was concealed, and what the diagnosis
    answered."""

    number: int
    """Number of the case in the test."""
    seed: int
    """Seed of its random draws."""
    kind: str
    """Kind of the case: nothing, single, pair, outside or without (`outcome`)."""
    bank: str
    """Part of the bank, see `study.evaluation.challenge.draw_bank`."""
    axes: str
    """Driven and measured axes."""
    model: str
    """Origin of the nominal model."""
    concealed: str
    """Names of the concealed effects. This and the other texts with several entries: separated by blanks."""
    at: str
    """Axis of each concealed effect; "all" for an effect on all axes."""
    strength: str
    """Strength of each concealed effect, 0 to 1."""
    adds: float
    """Rms change of the readings by the concealed effects, over the rms noise, in the worst channel."""
    detectable: bool
    """Whether the effects change the readings enough to be detected, by the limit of `outcome.DETECTABLE_ERROR`."""
    verdict: str
    """Verdict of the diagnosis."""
    named: str
    """Names of the effects that the diagnosis names."""
    named_at: str
    """Axis of each named effect; "all" for an effect on all axes."""
    probability: str
    """Probability of each named effect, as the diagnosis states it."""
    returned: str
    """The named effects and the rivals that the recordings do not distinguish from these."""
    main_error: float | None
    """Relative error of the main parameter of the effect; only where a single effect is concealed and named
    correctly."""
    retuned: float | None
    """Rms error on held-out samples over the rms noise, in the worst channel, with the model re-tuned."""
    after: float | None
    """The same with the named effects."""
    seconds: float | None
    """Processor time of the diagnosis (s)."""
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


def write_proof(result: BlindTest) -> None:
    """Write document, table, pictures and page into the test's folder, replacing earlier files. Raises StudyError where
    a file cannot be read or written."""
    folder, commit_hash = result.folder.path, read_answering_commit(result.folder.path, result.engines)
    score = result.score
    document = {
        "seed": result.plan.seed,
        "cases": result.plan.cases,
        "brief": result.plan.brief,
        "left_out": result.omitted_cases,
        "seal": result.seal,
        "engines": list(result.engines),
        "engines_beside": list(result.other_engines),
        "commit": commit_hash,
        "figures": [asdict(figure) for figure in score.figures],
        "calibration": asdict(score.calibration),
        "followed": [asdict(follow_up) for follow_up in result.follow_ups],
        "controls": [asdict(control) for control in result.controls],
        "misses": [miss.number for miss in score.misses],
    }
    rows = [_make_row(outcome, outcome in score.misses) for outcome in result.outcomes]
    write_document(folder, document, rows, CaseRow)
    pictures = make_blind_test_pictures(result.outcomes, score.calibration)
    write_pictures(folder / "figures", pictures)
    metadata = BlindTestMetadata(
        format_seed_range(result),
        result.seal,
        commit_hash,
        result.engines,
        tuple(list_remarks(result)),
        result.controls,
        result.follow_ups,
    )
    source = {"command": " ".join(anonymise_arguments(sys.argv))}
    page = render_blind_test_report(result.outcomes, score, pictures, metadata, source, format_local_now())
    write_text(folder / PAGE, page, overwrite=True)


def write_table(path: Path, result: BlindTest) -> None:
    """Write the figures to `path` and the misses beside it, see `write_figures`. Comment lines at the head of the first
    table state the cases, the code and the seal of the labels. Raises StudyError where a file cannot be read or
    written."""
    calibration = result.score.calibration
    named_count = sum(probability_bin.of for probability_bin in calibration.bins)
    calibration_figure = IntervalEstimate(
        "expected calibration error", calibration.error, calibration.low, calibration.high, named_count
    )
    failed_controls = [control.name for control in result.controls if not control.held]
    controls_text = (
        f"{len(result.controls) - len(failed_controls)} of {len(result.controls)} held"
        if result.controls
        else "not asked"
    )
    lines = [
        f"# {len(result.outcomes)} cases, seeds {format_seed_range(result)}",
        format_code_line(result.folder.path, result.engines),
        f"# follow-ups and controls by code {' '.join(result.other_engines) or 'none'}",
        f"# seal of the labels {result.seal}",
        f"# versions {json.dumps(list_versions())}",
        f"# controls {', not '.join((controls_text, *failed_controls))}",
    ]
    misses = [_make_row(miss, True) for miss in result.score.misses]
    write_figures(path, lines, (*result.score.figures, calibration_figure), misses, CaseRow)


def write_document(folder: Path, document: Mapping[str, Any], rows: Sequence[Row], row_type: type[Row]) -> None:
    """Write `proof.json` and `proof.csv`, a row per case, into `folder`, replacing earlier ones."""
    write_json(folder / DOCUMENT, FORMAT, VERSION, document, gather_provenance(), overwrite=True)
    write_text(folder / TABLE, format_csv_table(rows, row_type), overwrite=True)


def write_figures(
    path: Path, comments: Sequence[str], figures: Sequence[IntervalEstimate], misses: Sequence[Row], row_type: type[Row]
) -> None:
    """Write the figures, after the comments, to `path`, and the misses beside it: `figures.csv`,
    `figures-misses.csv`."""
    rows = [FigureRow(figure.name, figure.value, figure.low, figure.high, figure.of) for figure in figures]
    write_text(path, "\n".join(comments) + "\n" + format_csv_table(rows, FigureRow), overwrite=True)
    misses_path = path.with_name(f"{path.stem}-misses{path.suffix}")
    write_text(misses_path, format_csv_table(misses, row_type), overwrite=True)


def read_answering_commit(folder: Path, engines: tuple[str, ...]) -> str:
    """Read the commit of the code that answered: that in an earlier `proof.json` in `folder` by the same code; else the
    current commit, where the current code gave the answers or none were given; else "unknown: …". engines: digests of
    the code that answered."""
    document = folder / DOCUMENT
    if document.exists():
        earlier_document = read_json(document, FORMAT, VERSION)
        if earlier_document.get("engines") == list(engines) and isinstance(earlier_document.get("commit"), str):
            return str(earlier_document["commit"])
    return (
        read_current_commit() if engines in ((), (compute_engine_digest(),)) else "unknown: the code has changed since"
    )


def format_seed_range(result: BlindTest) -> str:
    """Format the first and the last seed of the cases: "1 to 500"."""
    return f"{result.plan.seed} to {result.plan.seed + result.plan.cases - 1}"


def format_code_line(folder: Path, engines: tuple[str, ...]) -> str:
    """Format the comment line of a table that states the code that answered; arguments of `read_answering_commit`."""
    return f"# commit {read_answering_commit(folder, engines)}, code of the diagnosis {' '.join(engines)}"


def read_current_commit() -> str:
    """Read the commit of the running checkout, with "+" appended if tracked files of its folders analysis or equalizer
    are changed; "unknown" where git fails."""
    root = Path(analysis.diagnosis.__path__[0]).parent
    try:
        commit_hash = _run_git(root, "rev-parse", "HEAD")
        return commit_hash + (
            "+" if _run_git(root, "status", "--porcelain", "--untracked-files=no", ".", "../equalizer") else ""
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def _run_git(folder: Path, *arguments: str) -> str:
    """Run a git command in a folder and return its output, stripped. Raises OSError where git cannot be run,
    CalledProcessError where it fails, TimeoutExpired after 60 s."""
    completed = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True, timeout=60)
    return completed.stdout.strip()


def _make_row(outcome: Outcome, counts_as_miss: bool) -> CaseRow:
    """Make the row of a case. counts_as_miss: whether it counts as a miss in the score."""
    is_named_right = outcome.kind == "single" and outcome.is_correct and bool(outcome.concealed)
    return CaseRow(
        outcome.number, outcome.seed, outcome.kind, outcome.bank, " ".join(outcome.axes), outcome.model,
        " ".join(outcome.names),
        " ".join(concealed.axis or "all" for concealed in outcome.concealed),
        " ".join(f"{value:.3f}" for value in outcome.strengths),
        round(outcome.adds, 4), outcome.detectable, outcome.verdict,
        " ".join(outcome.named_effect_names),
        " ".join(effect.axis or "all" for effect in outcome.named),
        " ".join(f"{effect.probability:.3f}" for effect in outcome.named),
        " ".join(outcome.returned),
        _round_cell(compute_main_error(outcome.concealed[0], outcome.named[0]) if is_named_right else None),
        _round_cell(outcome.compute_worst_error("retuned")), _round_cell(outcome.compute_worst_error("after")),
        _round_cell(outcome.seconds),
        counts_as_miss,
    )  # fmt: skip


def _round_cell(value: float | None) -> float | None:
    """Round a value to four decimals for the table; None for None and NaN."""
    return None if value is None or value != value else round(value, 4)
