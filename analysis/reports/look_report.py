"""Report of recordings before any model: what is wrong, then per recording its checks, channels and figures.

`summarise_overview` is the summary of a recording in a sentence. Checks and channels are values of
`analysis.look.overview`; here they become tables.
"""

from collections.abc import Mapping, Sequence

from analysis.figures.look_pictures import make_look_pictures
from analysis.figures.picture import Picture
from analysis.look.check import Check
from analysis.look.overview import Overview
from analysis.reports.page import Page, Section, Table, render_page
from analysis.wording import replace_time_units, typeset


def render_look_report(
    overviews: Sequence[Overview],
    pictures: Sequence[tuple[Picture, ...]],
    provenance: Mapping[str, str],
    generated: str,
) -> str:
    """The page about recordings. pictures: of each recording, as `pictures_of` gives them."""
    wrong = [(overview.name, check) for overview in overviews for check in overview.checks if check.level == "wrong"]
    sections = [
        section
        for overview, overview_pictures in zip(overviews, pictures, strict=True)
        for section in _recording_sections(overview, overview_pictures, overviews)
    ]
    return render_page(
        Page(
            title="A look at " + ", ".join(dict.fromkeys(overview.recording.device for overview in overviews)),
            summary=f"{len(overviews)} recording{'s' if len(overviews) > 1 else ''}, before any model. "
            + " ".join(summarise_overview(overview) for overview in overviews[:3]),
            banner=f"{len(wrong)} thing{'s' if len(wrong) > 1 else ''} would mislead an analysis: {wrong[0][1].seen}"
            if wrong
            else "",
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def pictures_of(overviews: Sequence[Overview]) -> tuple[tuple[Picture, ...], ...]:
    """Pictures of each recording; recordings are numbered from 1."""
    return tuple(make_look_pictures(overview, number) for number, overview in enumerate(overviews, start=1))


def summarise_overview(overview: Overview) -> str:
    """One sentence: what was recorded, for how long, and the result of the checks."""
    recording = overview.recording
    counts = {level: sum(check.level == level for check in overview.checks) for level in ("wrong", "notice", "fine")}
    text = (
        f"{overview.name}: {recording.response.duration_s:.4g} s at {recording.sample_rate_hz:.6g} Hz, "
        f"{len(overview.channels)} channels, {len(recording.segments)} segments; checks: {counts['wrong']} wrong, "
        f"{counts['notice']} to notice, {counts['fine']} fine."
    )
    return text if recording.is_timed else replace_time_units(text)


def _recording_sections(
    overview: Overview, pictures: Sequence[Picture], overviews: Sequence[Overview]
) -> tuple[Section, ...]:
    suffix = f" of {overview.name}" if len(overviews) > 1 else ""
    return (
        Section(f"Checks{suffix}", tables=(_check_table(overview.checks),)),
        Section(f"Channels{suffix}", tables=(_channel_table(overview),)),
        Section(f"Pictures{suffix}", pictures=tuple(pictures), tables=(_segment_table(overview),)),
    )


def _check_table(checks: Sequence[Check]) -> Table:
    rows = tuple((check.name, check.level, check.seen, check.do) for check in checks)
    return Table("What was checked", ("Check", "Result", "Seen", "What to do"), rows)


def _channel_table(overview: Overview) -> Table:
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


def _segment_table(overview: Overview) -> Table:
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
