"""Inspect recordings without a model (`hapteq look`): write a page with figures, lines of text, and a JSON document.

The results (levels, driven bands, coherence, repeats, consistency checks) come from `analysis.look`; this
module reads the files and writes the results.
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
"""Page about the recordings, in the folder of results."""

Progress = Callable[[float], None]
"""Callback with the share of the work that is done, 0 to 1."""


def inspect_recordings(paths: Sequence[Path], on_progress: Progress = lambda share: None) -> tuple[Overview, ...]:
    """Overviews of hapteq recordings, and of foreign files that can be imported without a map. Raises StudyError for
    other files."""
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
    provenance = {"recordings": ", ".join(entry.name for entry in overviews)}
    write_text(
        folder / PAGE_NAME, render_look_report(overviews, pictures, provenance, format_local_now()), overwrite=True
    )
    return folder / PAGE_NAME


def list_recording_facts(entry: Overview) -> tuple[str, ...]:
    """Lines about a recording: device, duration, sample rate, hold of the commands, metadata, remarks of the import."""
    recording, meta = entry.recording, entry.recording.meta
    parts = len(entry.stretches)
    rate = f"{recording.response.duration_s:.4g} s at {recording.sample_rate_hz:.6g} Hz, " if recording.is_timed else ""
    facts = [
        f"{entry.name}: {recording.device}, {rate}{len(recording)} samples{f' in {parts} parts' if parts > 1 else ''}",
        f"hold: {recording.hold.value}",
    ]
    omitted_keys = ("provenance", "parts", "import")
    facts += [
        f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in meta.items() if key not in omitted_keys
    ]
    origin = meta.get("import")
    notes = origin.get("notes", ()) if isinstance(origin, dict) else ()
    return (*facts, *(f"import: {note}" for note in notes))


def make_look_document(overviews: Sequence[Overview]) -> list[dict[str, Any]]:
    """JSON document: one object per recording. sample_rate_hz is 1 where the time axis is unknown; see `Recording`."""
    return [_describe_overview(entry) for entry in overviews]


def _describe_overview(entry: Overview) -> dict[str, Any]:
    """The results of one recording as plain values."""
    recording = entry.recording
    return {
        "recording": entry.name,
        "device": recording.device,
        "sample_rate_hz": recording.sample_rate_hz,
        "samples": len(recording),
        "hold": recording.hold.value,
        "time": "unknown" if recording.meta.get("time") == "unknown" else "known",
        "channels": [_replace_nonfinite(asdict(summary)) for summary in entry.summaries],
        "segments": [asdict(level) for level in entry.levels],
        "driven": [asdict(band) for band in entry.bands],
        "coherence": [
            {"response": c.response, "share": c.share, "lowest_hz": c.lowest_hz, "lowest": c.lowest}
            for c in entry.coherences
        ],
        "derivatives": [asdict(pair) for pair in entry.pairs],
        "found_period": entry.repeats.undeclared_period,
        "repeats": [asdict(noise) for noise in entry.repeats.noise],
        "checks": [asdict(check) for check in entry.checks],
    }


def _replace_nonfinite(entry: dict[str, Any]) -> dict[str, Any]:
    """The entry with None in place of NaN and infinity, which JSON does not have."""
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in entry.items()}
