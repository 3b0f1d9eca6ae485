"""Write the results of `hapteq real`, the diagnosis of a folder of recordings of real devices: an HTML page, tables
(CSV) and figures."""

from dataclasses import dataclass
from pathlib import Path

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.evaluation.blind_test.injected_faults import InjectedOutcome
from analysis.figures.diagnosis.real_held_out import make_real_picture
from analysis.reports.real_report import UnusableInput, render_real_report
from study.store.disk.csv_rows import format_csv_table
from study.store.disk.file_errors import convert_write_errors
from study.store.disk.provenance import gather_provenance
from study.store.disk.text_file import write_text
from study.workflows.picture_files import write_pictures

PAGE_NAME, TABLE_NAME, INJECTED_TABLE_NAME, FIGURES_FOLDER_NAME = (
    "report.html",
    "recordings.csv",
    "injected.csv",
    "figures",
)
"""Names in the folder for the results: page, table of recordings, table of injected faults, folder of figures."""


@dataclass(frozen=True, slots=True)
class RealRow:
    """A row of the table of recordings. Errors are on held-out data, as fractions of the signal; empty where none was
    measured."""

    folder: str
    """Sub-folder of the recording."""
    recording: str
    verdict: str
    effects: str
    """Effects that are named, separated by spaces."""
    measured_by: str
    """How the errors were measured, in words."""
    before: float | None
    """Error of the model as given."""
    retuned: float | None
    """Error of the model after its parameters were re-tuned."""
    after: float | None
    """Error with the named effects."""
    black_box: float | None
    """Error of a black-box model."""
    noise: float | None
    """Error from the difference between repeated measurements: the noise floor."""
    seconds: float
    """Duration of the diagnosis (s)."""
    candidates: str
    """Effects that were not confirmed, best first, separated by spaces."""


@dataclass(frozen=True, slots=True)
class InjectedRow:
    """A row of the table of injected faults; each field is as in `InjectedOutcome`, with lists as texts separated by
    spaces. injected: the faults joined by " + ", "nothing" without any; judged: `InjectedOutcome.answer_class`."""

    recording: str
    injected: str
    strength: float
    values: str
    change: float | None
    detectable: bool
    judged: str
    verdict: str
    named: str
    returned: str
    seconds: float


@dataclass(frozen=True, slots=True)
class RealResults:
    """Answers for a folder of real recordings, sub-folders that could not be used, and outcomes of injected faults."""

    answers: tuple[RealAnswer, ...]
    troubles: tuple[UnusableInput, ...]
    injected: tuple[InjectedOutcome, ...] = ()


@dataclass(frozen=True, slots=True)
class WrittenReal:
    """Results for a folder of real recordings, and the paths of page and table."""

    results: RealResults
    page: Path
    table: Path


def write_real_results(folder: Path, results: RealResults, generated: str) -> WrittenReal:
    """Write page, tables and figures into folder, replacing earlier ones; without injected faults, an earlier table of
    them is deleted. generated: date and time shown on the page. Raises CannotWriteError."""
    answers = results.answers
    pictures = {(answer.folder, answer.recording): make_real_picture(answer) for answer in answers}
    write_pictures(folder / FIGURES_FOLDER_NAME, tuple(pictures.values()))
    write_text(
        folder / TABLE_NAME, format_csv_table([_make_row(answer) for answer in answers], RealRow), overwrite=True
    )
    provenance = gather_provenance()
    provenance_texts = {
        "command": " ".join(provenance.command),
        "versions": ", ".join(f"{name} {version}" for name, version in provenance.versions.items()),
    }
    if results.injected:
        write_text(
            folder / INJECTED_TABLE_NAME,
            format_csv_table([_make_injection_row(outcome) for outcome in results.injected], InjectedRow),
            overwrite=True,
        )
    else:
        with convert_write_errors(folder / INJECTED_TABLE_NAME):
            (folder / INJECTED_TABLE_NAME).unlink(missing_ok=True)  # of an earlier run
    page = render_real_report(
        results.answers, results.troubles, results.injected, pictures, provenance_texts, generated
    )
    write_text(folder / PAGE_NAME, page, overwrite=True)
    return WrittenReal(results, folder / PAGE_NAME, folder / TABLE_NAME)


def _make_row(real_answer: RealAnswer) -> RealRow:
    """Make the row of a recording; the errors of its model are None without held-out data."""
    held_out_errors = real_answer.held_out
    error_as_given, error_retuned, error_with_effects, noise_floor = (
        (None, None, None, None)
        if held_out_errors is None
        else (held_out_errors.before, held_out_errors.retuned, held_out_errors.after, held_out_errors.noise)
    )
    effects = " ".join(real_answer.effects)
    return RealRow(
        real_answer.folder, real_answer.recording, real_answer.verdict, effects, real_answer.error,
        error_as_given, error_retuned, error_with_effects, real_answer.black_box, noise_floor, real_answer.seconds,
        " ".join(candidate.effect for candidate in real_answer.candidates),
    )  # fmt: skip


def _make_injection_row(outcome: InjectedOutcome) -> InjectedRow:
    """Make the row of a case; `injected` is "nothing" where no fault was injected."""
    values = " ".join(f"{name}={value:.6g}" for name, value in outcome.values.items())
    return InjectedRow(
        outcome.recording, outcome.injected or "nothing", outcome.strength, values, outcome.change,
        outcome.detectable, outcome.answer_class, outcome.verdict, " ".join(outcome.named),
        " ".join(outcome.returned), outcome.seconds,
    )  # fmt: skip
