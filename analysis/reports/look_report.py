"""The page about recordings before any model: what is wrong with them, what is in them."""

from collections.abc import Mapping, Sequence

from analysis.figures.look_pictures import look_pictures
from analysis.figures.picture import Picture
from analysis.look.check import Check
from analysis.look.overview import Overview
from analysis.reports.page import Page, Section, Table, render_page
from analysis.wording import typeset


def render_look_report(
    found: Sequence[Overview], pictures: Sequence[tuple[Picture, ...]], provenance: Mapping[str, str], generated: str
) -> str:
    """pictures: of each recording, as `pictures_of` gives them."""
    wrong = [(one.name, check) for one in found for check in one.checks if check.level == "wrong"]
    sections = [section for one, drawn in zip(found, pictures, strict=True) for section in _sections(one, drawn, found)]
    return render_page(
        Page(
            title="A look at " + ", ".join(dict.fromkeys(one.recording.device for one in found)),
            summary=f"{len(found)} recording{'s' if len(found) > 1 else ''}, before any model. "
            + " ".join(brief(one) for one in found[:3]),
            banner=f"{len(wrong)} thing{'s' if len(wrong) > 1 else ''} would mislead an analysis: {wrong[0][1].seen}"
            if wrong
            else "",
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def pictures_of(found: Sequence[Overview]) -> tuple[tuple[Picture, ...], ...]:
    return tuple(look_pictures(one, place) for place, one in enumerate(found, start=1))


def brief(found: Overview) -> str:
    """In a sentence: what was recorded, for how long, and what came of the checks."""
    recording = found.recording
    counts = {level: sum(check.level == level for check in found.checks) for level in ("wrong", "notice", "fine")}
    return (
        f"{found.name}: {recording.response.duration_s:.4g} s at {recording.sample_rate_hz:.6g} Hz, "
        f"{len(found.channels)} channels, {len(recording.segments)} segments; checks: {counts['wrong']} wrong, "
        f"{counts['notice']} to notice, {counts['fine']} fine."
    )


def _sections(one: Overview, pictures: Sequence[Picture], found: Sequence[Overview]) -> tuple[Section, ...]:
    of = f" of {one.name}" if len(found) > 1 else ""
    return (
        Section(f"Checks{of}", tables=(_checks(one.checks),)),
        Section(f"Channels{of}", tables=(_channels(one),)),
        Section(f"Pictures{of}", pictures=tuple(pictures), tables=(_segments(one),)),
    )


def _checks(checks: Sequence[Check]) -> Table:
    rows = tuple((check.name, check.level, check.seen, check.do) for check in checks)
    return Table("What was checked", ("Check", "", "Seen", "What to do"), rows)


def _channels(one: Overview) -> Table:
    header = ("Channel", "Quantity", "Unit", "Lowest", "Highest", "Mean", "Rms about it", "Missing")
    rows = tuple(
        (
            f"{summary.role} {summary.name}",
            summary.quantity,
            summary.unit,
            *(typeset(f"{value:.4g}") for value in (summary.lowest, summary.highest, summary.mean, summary.rms)),
            str(summary.missing),
        )
        for summary in one.summaries
    )
    return Table("Channels", header, rows)


def _segments(one: Overview) -> Table:
    header = (
        "Segment",
        "Role",
        "Start (s)",
        "Length (s)",
        "Period",
        *(f"Rms of {c.role} {c.name}" for c in one.channels),
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
        for level in one.levels
    )
    return Table("Segments", header, rows, folded=len(rows) > 12)
