"""Summary of a diagnosis for `hapteq diagnose` (`study.cli.diagnose`): lines for the terminal, and the JSON document of
`--json`."""

from pathlib import Path
from typing import Any

from analysis.diagnosis.document import FORMAT, VERSION, Errors, diagnosis_to_json
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.wording import write_summary_lines
from analysis.diagnosis.unit_wording import format_error
from study.store.formats.diagnosis_file import MODEL_NAME, PAGE_NAME


def make_json(findings: Findings) -> dict[str, Any]:
    """Make the document of `--json`: the values of diagnosis.json without its provenance."""
    return {"format": FORMAT, "version": VERSION, **diagnosis_to_json(findings.diagnosis)}


def format_answer(findings: Findings) -> tuple[str, ...]:
    """Format lines for the terminal: the verdict first, then the errors of the fitted and of the held-out parts."""
    diagnosis = findings.diagnosis
    return (
        *write_summary_lines(findings),
        "",
        f"Errors, normalised over the channels, measured by {diagnosis.error}:",
        _format_errors("fitted", diagnosis.fit.fit, bool(diagnosis.effects)),
        _format_errors("held out", diagnosis.fit.test, bool(diagnosis.effects)),
    )


def list_new_remarks(final_findings: Findings, printed_findings: Findings) -> tuple[str, ...]:
    """List the remarks that were added after the findings had been printed (`printed_findings`)."""
    return tuple(remark for remark in final_findings.remarks if remark not in printed_findings.remarks)


def format_paths(folder: Path) -> tuple[str, ...]:
    """Format lines with the paths of the report page and of the improved model. folder: that of the results."""
    return ("", f"Report: {folder / PAGE_NAME}", f"Improved model: {folder / MODEL_NAME}")


def _format_errors(data_part: str, errors: Errors, has_effects: bool) -> str:
    """Format a line with the errors of the given model, of the re-tuned model, of the model with the named effects (if
    there are any), and of noise alone. data_part: "fitted" or "held out"."""
    effects_text = f", with the effects {format_error(errors.after)}" if has_effects else ""
    return (
        f"  {data_part:<9} as given {format_error(errors.before)}, re-tuned {format_error(errors.retuned)}"
        f"{effects_text}; noise alone {format_error(errors.noise)}"
    )
