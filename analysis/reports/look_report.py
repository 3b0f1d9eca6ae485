"""HTML report of recordings before any model is fitted: per recording its checks, channels, segments and figures.

`render_look_report` makes the page from the checks and summaries of `analysis.look.overview`; a banner counts the
checks with the level "wrong" and quotes the first.
"""

from collections.abc import Mapping, Sequence

from analysis.figures.look_pictures import make_look_pictures
from analysis.figures.picture import Picture
from analysis.look.overview import Overview
from analysis.reports.page import Page, Section, Table, render_page
from analysis.wording import replace_time_units, typeset


def render_look_report(
    overviews: Sequence[Overview],
    pictures_by_recording: Sequence[tuple[Picture, ...]],
    provenance: Mapping[str, str],
    generated: str,
) -> str:
    """Render the page about recordings as HTML. pictures_by_recording: the pictures of each recording in the order of
    the overviews, from `make_recording_pictures`. provenance: versions and inputs by name. generated: local time of the
    report."""
    wrong_checks = [
        (overview.name, check) for overview in overviews for check in overview.checks if check.level == "wrong"
    ]
    sections = [
        section
        for overview, overview_pictures in zip(overviews, pictures_by_recording, strict=True)
        for section in _make_recording_sections(overview, overview_pictures, overviews)
    ]
    return render_page(
        Page(
            title="A look at " + ", ".join(dict.fromkeys(overview.recording.device for overview in overviews)),
            summary=f"{len(overviews)} recording{'s' if len(overviews) > 1 else ''}, before any model. "
            + " ".join(summarise_overview(overview) for overview in overviews[:3]),
            banner=f"{len(wrong_checks)} thing{'s' if len(wrong_checks) > 1 else ''} would mislead an analysis: "
            f"{wrong_checks[0][1].finding}"
            if wrong_checks
            else "",
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def make_recording_pictures(overviews: Sequence[Overview]) -> tuple[tuple[Picture, ...], ...]:
    """Draw the pictures of each recording, in the order of the overviews; their names contain the number of the
    recording, from 1."""
    return tuple(make_look_pictures(overview, number) for number, overview in enumerate(overviews, start=1))


def summarise_overview(overview: Overview) -> str:
    """Summarise a recording in a sentence: duration, sample rate, number of channels and segments, and the checks
    counted by level. Times are in samples where the recording has no time axis."""
    recording = overview.recording
    channel_count, segment_count = len(overview.channels), len(recording.segments)
    count_by_level = {
        level: sum(check.level == level for check in overview.checks) for level in ("wrong", "notice", "fine")
    }
    sentence = (
        f"{overview.name}: {recording.response.duration_s:.4g} s at {recording.sample_rate_hz:.6g} Hz, "
        f"{channel_count} channel{'s' if channel_count != 1 else ''}, "
        f"{segment_count} segment{'s' if segment_count != 1 else ''}; checks: "
        f"{count_by_level['wrong']} wrong, {count_by_level['notice']} to notice, {count_by_level['fine']} fine."
    )
    return sentence if recording.is_timed else replace_time_units(sentence)


def _make_recording_sections(
    overview: Overview, pictures: Sequence[Picture], all_overviews: Sequence[Overview]
) -> tuple[Section, ...]:
    """Make the sections of one recording, with its name in the headings where the page shows several."""
    title_suffix = f" of {overview.name}" if len(all_overviews) > 1 else ""
    check_rows = tuple((check.name, check.level, check.finding, check.advice) for check in overview.checks)
    return (
        Section(
            f"Checks{title_suffix}",
            tables=(Table("What was checked", ("Check", "Result", "Seen", "What to do"), check_rows),),
        ),
        Section(f"Channels{title_suffix}", tables=(_make_channel_table(overview),)),
        Section(f"Pictures{title_suffix}", pictures=tuple(pictures), tables=(_make_segment_table(overview),)),
    )


def _make_channel_table(overview: Overview) -> Table:
    """Make the table of the statistics of each channel, in its unit."""
    header = ("Channel", "Quantity", "Unit", "Lowest", "Highest", "Mean", "Rms about it", "Missing")
    rows = tuple(
        (
            f"{summary.role} {summary.name}",
            summary.quantity,
            summary.unit,
            *(
                typeset(f"{statistic:.4g}")
                for statistic in (summary.lowest, summary.highest, summary.mean, summary.rms)
            ),
            str(summary.missing),
        )
        for summary in overview.summaries
    )
    return Table("Channels", header, rows)


def _make_segment_table(overview: Overview) -> Table:
    """Make the table of the segments. Start and length are in s, or in samples where the recording has no time axis;
    the period in samples, empty where not periodic."""
    header = (
        "Segment",
        "Role",
        *(("Start (s)", "Length (s)") if overview.recording.is_timed else ("Start (samples)", "Length (samples)")),
        "Period",
        *(f"Rms of {channel.role} {channel.name}" for channel in overview.channels),
    )
    rows = tuple(
        (
            f"{segment_level.number} {segment_level.kind}" if segment_level.number else segment_level.kind,
            segment_level.role,
            f"{segment_level.start_s:.4g}",
            f"{segment_level.duration_s:.4g}",
            str(segment_level.period) if segment_level.period else "",
            *(f"{rms:.4g}" for rms in segment_level.rms),
        )
        for segment_level in overview.levels
    )
    return Table("Segments", header, rows, folded=len(rows) > 12)
