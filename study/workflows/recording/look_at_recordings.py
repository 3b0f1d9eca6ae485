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

from analysis.look.overview import Overview, overview
from analysis.reports.look_report import pictures_of, render_look_report
from study.local_clock import local_now
from study.store.disk.text_file import write_text
from study.workflows.picture_files import write_pictures
from study.workflows.recording.read_any_recording import read_any_recording

PAGE_NAME = "report.html"
"""Page about the recordings, in the folder of results."""

Progress = Callable[[float], None]
"""Function that is called with the share of the work that is done, 0 to 1."""


def look_at(paths: Sequence[Path], on_progress: Progress = lambda share: None) -> tuple[Overview, ...]:
    """Overviews of hapteq recordings, and of foreign files that can be imported without a map. Raises StudyError for
    other files."""
    found = []
    for count, path in enumerate(paths, start=1):
        recording, notes = read_any_recording(path)
        if notes:
            recording = replace(recording, meta={**recording.meta, "import": {"notes": list(notes)}})
        found.append(overview(path.stem, recording))
        on_progress(count / len(paths))
    return tuple(found)


def write_look(found: Sequence[Overview], folder: Path) -> Path:
    """Write report.html and figures/ in `folder`, replacing earlier files; returns the page's path. Raises
    CannotWriteError."""
    pictures = pictures_of(found)
    write_pictures(folder / "figures", [picture for drawn in pictures for picture in drawn])
    provenance = {"recordings": ", ".join(each.name for each in found)}
    write_text(folder / PAGE_NAME, render_look_report(found, pictures, provenance, local_now()), overwrite=True)
    return folder / PAGE_NAME


def list_recording_facts(found: Overview) -> tuple[str, ...]:
    """Lines of text: device, duration, sample rate, hold of the commands, metadata, remarks of the import."""
    recording, meta = found.recording, found.recording.meta
    parts = len(found.stretches)
    rate = f"{recording.response.duration_s:.4g} s at {recording.sample_rate_hz:.6g} Hz, " if recording.is_timed else ""
    facts = [
        f"{found.name}: {recording.device}, {rate}{len(recording)} samples{f' in {parts} parts' if parts > 1 else ''}",
        f"hold: {recording.hold.value}",
    ]
    left_out = ("provenance", "parts", "import")
    facts += [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in meta.items() if key not in left_out]
    origin = meta.get("import")
    notes = origin.get("notes", ()) if isinstance(origin, dict) else ()
    return (*facts, *(f"import: {note}" for note in notes))


def look_document(found: Sequence[Overview]) -> list[dict[str, Any]]:
    """JSON document: one object per recording. sample_rate_hz is 1 where the time axis is unknown; see `Recording`."""
    return [_describe_recording_entry(each) for each in found]


def _describe_recording_entry(each: Overview) -> dict[str, Any]:
    """The results of one recording as plain values."""
    recording = each.recording
    return {
        "recording": each.name,
        "device": recording.device,
        "sample_rate_hz": recording.sample_rate_hz,
        "samples": len(recording),
        "hold": recording.hold.value,
        "time": "unknown" if recording.meta.get("time") == "unknown" else "known",
        "channels": [_finite(asdict(summary)) for summary in each.summaries],
        "segments": [asdict(level) for level in each.levels],
        "driven": [asdict(band) for band in each.bands],
        "coherence": [
            {"response": c.response, "share": c.share, "lowest_hz": c.lowest_hz, "lowest": c.lowest}
            for c in each.coherences
        ],
        "derivatives": [asdict(pair) for pair in each.pairs],
        "found_period": each.repeats.found,
        "repeats": [asdict(noise) for noise in each.repeats.noise],
        "checks": [asdict(check) for check in each.checks],
    }


def _finite(entry: dict[str, Any]) -> dict[str, Any]:
    """The entry with None in place of NaN and infinity, which JSON does not have."""
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in entry.items()}
