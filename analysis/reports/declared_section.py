"""First section of a study report: the contrast declared in the protocol, by both analyses, with sample and exclusions.

The section shows the result that was fixed before the data were collected (`declared_result`), so that a reader can
distinguish it from results chosen afterwards.
"""

from analysis.psychophysics.declared_result import ContrastResult, DeclaredResult
from analysis.reports.page import Section, Table
from analysis.wording import MISSING, format_p, format_p_text, format_signed

NAMES = {"hierarchical": "hierarchical model of all answers", "published": "published one-way analysis"}


def make_declared_section(declaration: str, result: DeclaredResult) -> Section:
    """The section on the declared result. declaration: text on what was declared and what was not. Where nothing was
    declared, the section consists of this text."""
    heading = "The declared result"
    if not _is_anything_declared(result):
        return Section(heading, paragraphs=(declaration,))
    tables = (_contrast_table(result),) if result.results else ()
    sentences = [_contrast_sentence(row, result) for row in result.results if row.declared]
    return Section(heading, paragraphs=(declaration, *sentences), tables=(*tables, _sample_table(result)))


def describe_declared(result: DeclaredResult) -> tuple[str, ...]:
    """A sentence on the declared contrast per analysis, the declared analysis first; empty without a contrast."""
    return tuple(_contrast_sentence(row, result) for row in result.results)


def _is_anything_declared(result: DeclaredResult) -> bool:
    return result.primary != "undeclared" or bool(
        result.contrast_hz or result.participants_declared or result.exclusions
    )


def _contrast_sentence(row: ContrastResult, result: DeclaredResult) -> str:
    """Sentence on the contrast by one analysis, with interval, p and notes."""
    first, second = result.contrast_hz
    role = ", the declared analysis" if row.declared else ""
    contrast_words = f"Declared contrast, {first:g} Hz minus {second:g} Hz, by the {NAMES[row.analysis]}{role}:"
    if row.difference is None:
        return f"{contrast_words} not known. {' '.join(row.notes)}"
    digits, percent = _decimals(row), f"{100 * result.confidence:g} %"
    return (
        f"{contrast_words} {format_signed(row.difference, digits)} {row.unit} "
        f"({percent} interval {_interval_text(row)} {row.unit}, {format_p_text(row.p)}). {' '.join(row.notes)}"
    ).strip()


def _contrast_table(result: DeclaredResult) -> Table:
    """Table of the contrast with a row per analysis."""
    first, second = result.contrast_hz
    rows = []
    for row in result.results:
        role = " (declared)" if row.declared else ""
        n, m = row.participants
        size = MISSING if row.difference is None else f"{format_signed(row.difference, _decimals(row))} {row.unit}"
        interval = MISSING if row.difference is None else f"{_interval_text(row)} {row.unit}"
        people = str(n) if n == m else f"{n} and {m}"
        rows.append((f"{NAMES[row.analysis]}{role}", people, size, interval, format_p(row.p)))
    notes = tuple(f"{NAMES[row.analysis].capitalize()}: {note}" for row in result.results for note in row.notes)
    return Table(
        caption=f"Declared contrast: threshold at {first:g} Hz minus that at {second:g} Hz",
        header=("Analysis", "Participants", "Difference", f"{100 * result.confidence:g} % interval", "p"),
        rows=tuple(rows),
        notes=notes if any(row.declared for row in result.results) else (*notes, "Which analysis decides: undeclared."),
    )


def _sample_table(result: DeclaredResult) -> Table:
    """Table of sample size and exclusions, declared and actual."""
    return Table(
        caption="Participants and exclusions",
        header=("", "Declared", "In this analysis"),
        rows=(
            (
                "Participants",
                str(result.participants_declared) if result.participants_declared else "none declared",
                str(result.participants_analysed),
            ),
            (
                "Left out",
                " ".join(result.exclusions) or "none declared",
                " ".join(result.left_out) or "nothing was left out",
            ),
        ),
    )


def _interval_text(row: ContrastResult) -> str:
    """Limits of the interval as text without unit; `MISSING` for a limit that is not determined."""
    ends = [MISSING if end is None else format_signed(end, _decimals(row)) for end in (row.lower, row.upper)]
    return " to ".join(ends)


def _decimals(row: ContrastResult) -> int:
    """Decimals of a difference: one in dB, two in N."""
    return 1 if row.unit == "dB" else 2
