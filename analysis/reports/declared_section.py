"""First section of a study report: the contrast declared in the protocol, by both analyses, with sample and exclusions.

The section shows the result that was fixed before the data were collected (`declared_result`), so that a reader can
distinguish it from results chosen afterwards.
"""

from analysis.psychophysics.declared_result import ContrastResult, DeclaredResult
from analysis.reports.page import Section, Table
from analysis.wording import MISSING, choose_decimals, format_p, format_p_text, format_signed

ANALYSIS_NAMES = {"hierarchical": "hierarchical model of all answers", "published": "published one-way analysis"}
"""Name of each analysis in sentences and tables, by its value in the protocol."""


def make_declared_section(declaration: str, result: DeclaredResult) -> Section:
    """Make the section on the declared result. declaration: text on what was declared and what was not. Where nothing
    was declared, the section consists of this text."""
    heading = "The declared result"
    if not _is_anything_declared(result):
        return Section(heading, paragraphs=(declaration,))
    tables = (_tabulate_contrasts(result),) if result.results else ()
    sentences = [_describe_contrast(contrast, result) for contrast in result.results if contrast.declared]
    return Section(heading, paragraphs=(declaration, *sentences), tables=(*tables, _tabulate_sample(result)))


def describe_declared(result: DeclaredResult) -> tuple[str, ...]:
    """Describe the declared contrast in a sentence per analysis, the declared analysis first; empty without a
    contrast."""
    return tuple(_describe_contrast(contrast, result) for contrast in result.results)


def _is_anything_declared(result: DeclaredResult) -> bool:
    """Whether the protocol declares an analysis, a contrast, a sample size or exclusions."""
    return result.primary != "undeclared" or bool(
        result.contrast_hz or result.participants_declared or result.exclusions
    )


def _describe_contrast(contrast: ContrastResult, result: DeclaredResult) -> str:
    """Describe the contrast by one analysis, with interval, p and notes, or that its difference is not known."""
    first_hz, second_hz = result.contrast_hz
    role = ", the declared analysis" if contrast.declared else ""
    opening = (
        f"Declared contrast, {first_hz:g} Hz minus {second_hz:g} Hz, by the {ANALYSIS_NAMES[contrast.analysis]}{role}:"
    )
    if contrast.difference is None:
        return f"{opening} not known. {' '.join(contrast.notes)}"
    decimals, confidence_text = _choose_decimals(contrast), f"{100 * result.confidence:g} %"
    return (
        f"{opening} {format_signed(contrast.difference, decimals)} {contrast.unit} "
        f"({confidence_text} interval {_format_interval(contrast)} {contrast.unit}, "
        f"{format_p_text(contrast.p)}). {' '.join(contrast.notes)}"
    ).strip()


def _tabulate_contrasts(result: DeclaredResult) -> Table:
    """Tabulate the declared contrast, a row per analysis."""
    first_hz, second_hz = result.contrast_hz
    rows = []
    for contrast in result.results:
        role_text = " (declared)" if contrast.declared else ""
        first_count, second_count = contrast.participants
        difference_text = (
            MISSING
            if contrast.difference is None
            else f"{format_signed(contrast.difference, _choose_decimals(contrast))} {contrast.unit}"
        )
        interval_text = MISSING if contrast.difference is None else f"{_format_interval(contrast)} {contrast.unit}"
        participants_text = str(first_count) if first_count == second_count else f"{first_count} and {second_count}"
        rows.append(
            (
                f"{ANALYSIS_NAMES[contrast.analysis]}{role_text}",
                participants_text,
                difference_text,
                interval_text,
                format_p(contrast.p),
            )
        )
    notes = tuple(
        f"{ANALYSIS_NAMES[contrast.analysis].capitalize()}: {note}"
        for contrast in result.results
        for note in contrast.notes
    )
    return Table(
        caption=f"Declared contrast: threshold at {first_hz:g} Hz minus that at {second_hz:g} Hz",
        header=("Analysis", "Participants", "Difference", f"{100 * result.confidence:g} % interval", "p"),
        rows=tuple(rows),
        notes=notes
        if any(contrast.declared for contrast in result.results)
        else (*notes, "Which analysis decides: undeclared."),
    )


def _tabulate_sample(result: DeclaredResult) -> Table:
    """Tabulate sample size and exclusions, declared and actual."""
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


def _format_interval(contrast: ContrastResult) -> str:
    """Format the limits of the interval without unit; `MISSING` for a limit that is not determined."""
    limit_texts = [
        MISSING if interval_limit is None else format_signed(interval_limit, _choose_decimals(contrast))
        for interval_limit in (contrast.lower, contrast.upper)
    ]
    return " to ".join(limit_texts)


def _choose_decimals(contrast: ContrastResult) -> int:
    """Choose the number of decimals of a difference and its interval: one in dB, two or more in N."""
    return 1 if contrast.unit == "dB" else choose_decimals(contrast.difference, contrast.lower, contrast.upper)
