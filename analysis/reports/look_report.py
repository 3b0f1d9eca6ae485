"""Report of recordings before any model: what is wrong, then per recording its checks, channels and figures.

`brief` is the summary of a recording in a sentence. Checks and channels are values of
`analysis.look.overview`; here they become tables.
"""

from collections.abc import Mapping, Sequence

from analysis.figures.look_pictures import look_pictures
from analysis.figures.picture import Picture
from analysis.look.check import Check
from analysis.look.overview import Overview
from analysis.reports.page import Page, Section, Table, render_page
from analysis.wording import typeset, write_without_time


def render_look_report(
    found: Sequence[Overview], pictures: Sequence[tuple[Picture, ...]], provenance: Mapping[str, str], generated: str
) -> str:
    """The page about recordings. pictures: of each recording, as `pictures_of` gives them."""
    wrong = [(each.name, check) for each in found for check in each.checks if check.level == "wrong"]
    sections = [
        section for each, drawn in zip(found, pictures, strict=True) for section in _sections(each, drawn, found)
    ]
    return render_page(
        Page(
            title="A look at " + ", ".join(dict.fromkeys(each.recording.device for each in found)),
            summary=f"{len(found)} recording{'s' if len(found) > 1 else ''}, before any model. "
            + " ".join(brief(each) for each in found[:3]),
            banner=f"{len(wrong)} thing{'s' if len(wrong) > 1 else ''} would mislead an analysis: {wrong[0][1].seen}"
            if wrong
            else "",
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def pictures_of(found: Sequence[Overview]) -> tuple[tuple[Picture, ...], ...]:
    """Pictures of each recording; recordings are numbered from 1."""
    return tuple(look_pictures(each, place) for place, each in enumerate(found, start=1))


def brief(found: Overview) -> str:
    """One sentence: what was recorded, for how long, and the result of the checks."""
    recording = found.recording
    counts = {level: sum(check.level == level for check in found.checks) for level in ("wrong", "notice", "fine")}
    text = (
        f"{found.name}: {recording.response.duration_s:.4g} s at {recording.sample_rate_hz:.6g} Hz, "
        f"{len(found.channels)} channels, {len(recording.segments)} segments; checks: {counts['wrong']} wrong, "
        f"{counts['notice']} to notice, {counts['fine']} fine."
    )
    return text if recording.is_timed else write_without_time(text)


def _sections(overview: Overview, pictures: Sequence[Picture], found: Sequence[Overview]) -> tuple[Section, ...]:
    of = f" of {overview.name}" if len(found) > 1 else ""
    return (
        Section(f"Checks{of}", tables=(_checks(overview.checks),)),
        Section(f"Channels{of}", tables=(_channels(overview),)),
        Section(f"Pictures{of}", pictures=tuple(pictures), tables=(_segments(overview),)),
    )


def _checks(checks: Sequence[Check]) -> Table:
    rows = tuple((check.name, check.level, check.seen, check.do) for check in checks)
    return Table("What was checked", ("Check", "Result", "Seen", "What to do"), rows)


def _channels(overview: Overview) -> Table:
    header = ("Channel", "Quantity", "Unit", "Lowest", "Highest", "Mean", "Rms about it", "Missing")
    rows = tuple(
        (
            f"{summary.role} {summary.name}",
            summary.quantity,
            summary.unit,
            *(typeset(f"{value:.4g}") for value in (summary.lowest, summary.highest, summary.mean, summary.rms)),
            str(summary.missing),
        )
        for summary in overview.summaries
    )
    return Table("Channels", header, rows)


def _segments(overview: Overview) -> Table:
    header = (
        "Segment",
        "Role",
        *(("Start (s)", "Length (s)") if overview.recording.is_timed else ("Start (samples)", "Length (samples)")),
        "Period",
        *(f"Rms of {c.role} {c.name}" for c in overview.channels),
    )
    rows = tuple(
        (
            f"{level.number} {level.kind}" if level.number else level.kind,
            level.role,
            f"{level.start_s:.4g}",
            f"{level.duration_s:.4g}",
            str(level.period) if level.period else "",
            *(f"{value:.4g}" for value in level.rms),
        )
        for level in overview.levels
    )
    return Table("Segments", header, rows, folded=len(rows) > 12)
