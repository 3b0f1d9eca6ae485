"""HTML report of the reproduction of the five published figures on a simulated omega.3.

Per figure: what the paper states, what came out here, whether both agree by a stated rule, and what differs in the
method. `analysis.evaluation.reproduction` computes the findings; `render_reproduction_report` formats them.
"""

from collections.abc import Mapping, Sequence

from analysis.evaluation.reproduction.document import FigureFindings, Finding, PlayedRow, Reproduction
from analysis.figures.picture import Picture
from analysis.reports.page import Page, Section, Table, render_page
from analysis.wording import MISSING, format_number

BANNER = (
    "Everything here was simulated: the device, and those who answered. The simulation was set up to show the "
    "features that the paper reports, so their appearance here confirms nothing about the paper or about a real "
    "omega.3. It shows only that the methods run from end to end, and which results they give on a device of this "
    "kind."
)

_AGREEMENT_WORDS: dict[bool | None, str] = {True: "yes", False: "no", None: "–"}
"""Text by `Finding.as_published`; None: not compared."""

_MEASURE_HEADINGS = ("Flatness", "Worst coupling", "Median coupling", "Axis error", "Error")
"""Column headings of the values of `_format_measures`."""

_MODEL_NOTE = (
    "Root mean squares relative to the response, as measured. Held out: the prediction of a record that the fit did "
    "not see. Expected: with the misfit to the fitted lines and the scatter that their noise leaves; never below the "
    "held-out error."
)
_ROW_NOTES = (
    "Over every line of the band, worst axis: flatness is the largest deviation from the target level; coupling the "
    "largest off-axis response over that along the axis; axis error the largest angle between the target axis and what "
    "is played; error the root mean square of the deviation from the target. Rows that are not equalized are "
    "scaled by their mean gain first.",
)
"""Notes below the table of the rows of figure 5."""
_BASELINE_NOTES = (
    "Swept sines, as in the figure. Every row but the last of 'edge' and 'in the hand' uses only what was identified "
    "at the centre without a hand. 'Nothing' commands the target number of m/s² in N, so its flatness is a gain that "
    "was never set; 'static gain' sets it. The rigid-body model is fitted to the whole band here; the raw estimate "
    "is the measured response, inverted line by line. Cost: multiplications and additions per sample, of a form that "
    "runs sample by sample.",
)
"""Notes below the table of other ways of driving the device."""


def render_reproduction_report(
    reproduction: Reproduction,
    pictures: Mapping[int, Sequence[Picture]],
    provenance: Mapping[str, str],
    generated: str,
) -> str:
    """Render the report as an HTML page. pictures: by the number of the published figure; a figure without an entry has
    none. provenance: versions and hashes by name. generated: local time of the report."""
    sections = [*_make_model_sections(reproduction), _make_overview_section(reproduction)]
    for figure in sorted(reproduction.figures, key=lambda findings: findings.figure):
        played_tables = _make_played_tables(reproduction) if figure.figure == 5 else ()
        tables = (_make_findings_table(figure), *played_tables)
        sections.append(_make_figure_section(figure, pictures.get(figure.figure, ()), tables))
    low_hz, high_hz = reproduction.band_hz
    return render_page(
        Page(
            title="The five published figures, on the simulated omega.3",
            summary=f"{reproduction.subjects} simulated participants, {reproduction.device}, models of order "
            f"{reproduction.order} from {low_hz:g} to {high_hz:g} Hz, seed {reproduction.seed}. Published: "
            "R. P. Wilson, S. Chan, J. K. Salisbury, G. Niemeyer: Multi-DOF Equalization of Haptic Devices "
            "for Accurate Rendering at High Frequencies.",
            banner=BANNER,
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def summarise_figures(reproduction: Reproduction) -> tuple[str, ...]:
    """Summarise each figure in a line for a terminal: number of findings that agree with the paper, of those compared,
    and its title."""
    return tuple(
        f"Figure {figure.figure}: {_format_agreement(figure)}  {figure.title}"
        for figure in sorted(reproduction.figures, key=lambda figure: figure.figure)
    )


def _make_model_sections(reproduction: Reproduction) -> list[Section]:
    """Make the section on the errors of the identified models; empty without models."""
    if not reproduction.models:
        return []
    rows = tuple(
        (
            model.name,
            _format_percent(model.held_out_error),
            _format_percent(model.held_out_noise),
            _format_percent(model.expected_error),
        )
        for model in reproduction.models
    )
    header = ("Model", "Held-out error", "Noise of that record", "Expected error")
    table = Table("Quality of the identified models", header, rows, notes=(_MODEL_NOTE,))
    return [Section("How good the models are", tables=(table,))]


def _format_percent(error_share: float | None) -> str:
    """Format a share (0 to 1) in percent with two decimals; a dash for None."""
    return MISSING if error_share is None else f"{100 * error_share:.2f} %"


def _make_overview_section(reproduction: Reproduction) -> Section:
    """Make the section with the number of findings that agree with the paper, and a list of those that do not."""
    compared_findings = [
        finding for figure in reproduction.figures for finding in figure.findings if _is_compared(finding)
    ]
    agreement_count = sum(finding.as_published is True for finding in compared_findings)
    differing_findings = tuple(
        f"Figure {figure.figure}, {finding.what}: published {finding.published}; here {finding.here}."
        for figure in sorted(reproduction.figures, key=lambda figure: figure.figure)
        for finding in figure.findings
        if finding.as_published is False
    )
    summary_sentence = (
        f"Of {len(compared_findings)} things that the paper says of its figures and that can be compared by a rule, "
        f"{agreement_count} came out as published. The rules are ours and are given below each table."
    )
    list_introduction = " These did not:" if differing_findings else ""
    return Section("What came out", paragraphs=(summary_sentence + list_introduction,), points=differing_findings)


def _make_figure_section(figure: FigureFindings, pictures: Sequence[Picture], tables: tuple[Table, ...]) -> Section:
    """Make the section on one figure; the table of its remarks follows the given tables."""
    return Section(
        f"Figure {figure.figure}: {figure.title}",
        paragraphs=(
            f"Published ({figure.source}): {figure.published}",
            "What is different here, and why:",
        ),
        points=figure.differs,
        pictures=tuple(pictures),
        tables=(*tables, *_make_remark_tables(figure)),
    )


def _make_findings_table(figure: FigureFindings) -> Table:
    """Make the table of published and reproduced findings of a figure; the rules of comparison are its notes."""
    rows = tuple(
        (finding.what, finding.published or "–", finding.here, _AGREEMENT_WORDS[finding.as_published])
        for finding in figure.findings
    )
    rule_notes = tuple(
        f"{finding.what}: as published means {finding.rule}." for finding in figure.findings if finding.rule
    )
    return Table(
        f"Figure {figure.figure}: published and here", ("", "Published", "Here", "As published"), rows, notes=rule_notes
    )


def _make_remark_tables(figure: FigureFindings) -> tuple[Table, ...]:
    """Make the folded table of the remarks of the analyses; empty without remarks."""
    if not figure.remarks:
        return ()
    rows = tuple((str(number), remark) for number, remark in enumerate(figure.remarks, start=1))
    return (Table(f"Remarks on figure {figure.figure}", ("", "What the analyses noted"), rows, folded=True),)


def _make_played_tables(reproduction: Reproduction) -> tuple[Table, ...]:
    """Make the table of the quality of every row of figure 5, and, where the document has baselines, a second one of
    other ways of driving the device."""
    header = ("", "Device", "Target", *_MEASURE_HEADINGS)
    rows = tuple((row.name, row.device, row.signal, *_format_measures(row)) for row in reproduction.played)
    tables = [Table("What was played, row by row", header, rows, notes=_ROW_NOTES)]
    if reproduction.baselines:
        baseline_header = ("", *_MEASURE_HEADINGS, "Cost")
        baseline_rows = tuple((row.name, *_format_measures(row), _format_cost(row)) for row in reproduction.baselines)
        tables.append(Table("Other ways of driving the device", baseline_header, baseline_rows, notes=_BASELINE_NOTES))
    return tuple(tables)


def _format_measures(row: PlayedRow) -> tuple[str, ...]:
    """Format the values under `_MEASURE_HEADINGS`, with units."""
    return (
        f"{format_number(row.flatness_db)} dB",
        f"{format_number(row.coupling_db, 1)} dB",
        f"{format_number(row.median_coupling_db, 1)} dB",
        f"{row.axis_error_deg:.1f}°",
        f"{100 * row.error:.1f} %",
    )


def _format_cost(row: PlayedRow) -> str:
    """Format the multiplications and additions per sample; a dash where they were not counted."""
    return "–" if row.multiply_adds is None else f"{row.multiply_adds}"


def _is_compared(finding: Finding) -> bool:
    """Whether a rule compares the finding with the paper."""
    return finding.as_published is not None


def _format_agreement(figure: FigureFindings) -> str:
    """Format the number of findings of a figure that agree with the paper, of those compared."""
    compared = [finding for finding in figure.findings if _is_compared(finding)]
    return f"{sum(finding.as_published is True for finding in compared)} of {len(compared)} as published."
