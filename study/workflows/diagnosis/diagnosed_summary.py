"""Summary of a diagnosis: lines for the terminal, and the document of `--json` with the values of diagnosis.json."""

from pathlib import Path
from typing import Any

from analysis.diagnosis.document import FORMAT, VERSION, Errors, diagnosis_to_json
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.wording import summary_lines
from analysis.diagnosis.unit_wording import error_text
from study.store.formats.diagnosis_file import MODEL_NAME, PAGE_NAME


def summary(findings: Findings) -> dict[str, Any]:
    """The diagnosis as plain values, as in diagnosis.json but without its provenance."""
    return {"format": FORMAT, "version": VERSION, **diagnosis_to_json(findings.diagnosis)}


def answer_lines(findings: Findings) -> tuple[str, ...]:
    """Lines for the terminal: the verdict first, then the errors of the fitted and of the held-out parts."""
    found = findings.diagnosis
    return (
        *summary_lines(findings),
        "",
        f"Errors, normalised over the channels, measured by {found.error}:",
        _errors("fitted", found.fit.fit, bool(found.effects)),
        _errors("held out", found.fit.test, bool(found.effects)),
    )


def new_remarks(written: Findings, earlier: Findings) -> tuple[str, ...]:
    """Remarks that were added while the report was written, after the answer had been printed. earlier: the findings as
    printed."""
    return tuple(remark for remark in written.remarks if remark not in earlier.remarks)


def file_lines(out: Path) -> tuple[str, ...]:
    """Lines with the paths of the page and of the improved model in the folder `out`."""
    return ("", f"Report: {out / PAGE_NAME}", f"Improved model: {out / MODEL_NAME}")


def _errors(which: str, errors: Errors, named: bool) -> str:
    """Errors of the given model, of the re-tuned one, with the named effects, and of noise alone."""
    after = f", with the effects {error_text(errors.after)}" if named else ""
    return (
        f"  {which:<9} as given {error_text(errors.before)}, re-tuned {error_text(errors.retuned)}"
        f"{after}; noise alone {error_text(errors.noise)}"
    )
