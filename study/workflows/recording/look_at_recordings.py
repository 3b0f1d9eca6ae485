"""Inspect recordings without a model (`hapteq look`): a page with figures, lines of text, and a JSON document.

The results (levels, driven bands, coherence, repeats, consistency checks) come from `analysis.look`; this module reads
the files and writes the results.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.look.overview import Overview, make_overview
from analysis.reports.look_report import make_recording_pictures, render_look_report
from study.local_clock import format_local_now
from study.store.disk.text_file import write_text
from study.workflows.picture_files import write_pictures
from study.workflows.recording.read_any_recording import read_any_recording

PAGE_NAME = "report.html"

Progress = Callable[[float], None]
"""Callback with the share of the work that is done, 0 to 1."""


def inspect_recordings(paths: Sequence[Path], on_progress: Progress = lambda share: None) -> tuple[Overview, ...]:
    """Compute the overviews of hapteq recordings, and of foreign files that can be imported without a map; remarks on
    the import are added to their metadata. on_progress: called after each file. Raises StudyError for other files."""
    overviews = []
    for count, path in enumerate(paths, start=1):
        recording, notes = read_any_recording(path)
        if notes:
            recording = replace(recording, meta={**recording.meta, "import": {"notes": list(notes)}})
        overviews.append(make_overview(path.stem, recording))
        on_progress(count / len(paths))
    return tuple(overviews)


def write_look_page(overviews: Sequence[Overview], folder: Path) -> Path:
    """Write report.html and figures/ in `folder`, replacing earlier files; returns the page's path. Raises
    CannotWriteError."""
    pictures = make_recording_pictures(overviews)
    write_pictures(folder / "figures", [picture for recording_pictures in pictures for picture in recording_pictures])
    provenance = {"recordings": ", ".join(overview.name for overview in overviews)}
    write_text(
        folder / PAGE_NAME, render_look_report(overviews, pictures, provenance, format_local_now()), overwrite=True
    )
    return folder / PAGE_NAME


def list_recording_facts(overview: Overview) -> tuple[str, ...]:
    """Format lines about a recording: device, duration, sample rate, hold of the commands, metadata, remarks of the
    import."""
    recording, meta = overview.recording, overview.recording.meta
    part_count = len(overview.stretches)
    timing_text = (
        f"{recording.response.duration_s:.4g} s at {recording.sample_rate_hz:.6g} Hz, " if recording.is_timed else ""
    )
    lines = [
        f"{overview.name}: {recording.device}, {timing_text}{len(recording)} samples"
        f"{f' in {part_count} parts' if part_count > 1 else ''}",
        f"hold: {recording.hold.value}",
    ]
    omitted_keys = ("provenance", "parts", "import")
    lines += [
        f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in meta.items() if key not in omitted_keys
    ]
    return (*lines, *(f"import: {note}" for note in list_import_notes(overview)))


def list_import_notes(overview: Overview) -> tuple[str, ...]:
    """List the remarks of the import of a recording, as sentences; empty for one that was not imported."""
    import_metadata = overview.recording.meta.get("import")
    notes = import_metadata.get("notes") if isinstance(import_metadata, dict) else None
    return tuple(map(str, notes)) if isinstance(notes, list | tuple) else ()


def make_look_document(overviews: Sequence[Overview]) -> list[dict[str, Any]]:
    """Make the JSON document: one object per recording. sample_rate_hz is 1 where the time axis is unknown; see
    `Recording`."""
    return [_describe_overview(overview) for overview in overviews]


def _describe_overview(overview: Overview) -> dict[str, Any]:
    """Collect the results of one recording as plain values."""
    recording = overview.recording
    return {
        "recording": overview.name,
        "device": recording.device,
        "sample_rate_hz": recording.sample_rate_hz,
        "samples": len(recording),
        "hold": recording.hold.value,
        "time": "unknown" if recording.meta.get("time") == "unknown" else "known",
        "channels": [_replace_nonfinite(asdict(summary)) for summary in overview.summaries],
        "segments": [asdict(level) for level in overview.levels],
        "driven": [asdict(band) for band in overview.bands],
        "coherence": [
            {
                "response": coherence.response,
                "share": coherence.share,
                "lowest_hz": coherence.lowest_hz,
                "lowest": coherence.lowest,
            }
            for coherence in overview.coherences
        ],
        "derivatives": [asdict(pair) for pair in overview.pairs],
        "found_period": overview.repeats.undeclared_period,
        "repeats": [asdict(noise) for noise in overview.repeats.noise],
        "checks": [asdict(check) for check in overview.checks],
    }


def _replace_nonfinite(values: dict[str, Any]) -> dict[str, Any]:
    """Replace NaN and infinity, which JSON does not have, by None in the values of a dictionary."""
    return {
        key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in values.items()
    }
