"""Read the direction limit of a study from `anova.json`, as the upper end of the band of an identified model.

The direction limit is the frequency (Hz) at which the median threshold for telling directions apart reaches the force
cap (docs/statistics.md). Above it, most participants cannot tell directions apart at forces below the cap.
"""

import json
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from study.store.disk.file_errors import UnusableFileError
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text

FORMAT = "hapteq-anova"
"""Format of anova.json."""
KIND = "analysis of a study"
"""Kind of the file, as stated in error messages."""
ANALYSIS_ADVICE = "Give the anova.json that `hapteq analyze` writes for a study with two participants or more."
"""Remedy in the messages about a file that is no such analysis."""


@dataclass(frozen=True, slots=True)
class StudyBand:
    """A frequency band (Hz) whose upper end is the direction limit estimated by a study."""

    band_hz: tuple[float, float]
    origin: str
    """Source of the upper end, with its interval, in words."""


def read_study_band(path: Path, lowest_hz: float) -> StudyBand:
    """Read the band from `lowest_hz` to the direction limit of an analysis. path: its anova.json. Raises
    CannotReadError, and UnusableFileError where the file is no such analysis, states no limit, or a limit not above
    `lowest_hz`."""
    try:
        document = load_json(read_text(path))
    except ValueError as error:
        raise UnusableFileError(path, KIND, (str(error),), ANALYSIS_ADVICE) from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise UnusableFileError(path, KIND, (f'"format" is not {json.dumps(FORMAT)}',), ANALYSIS_ADVICE)
    limit_hz = _read_limit_value(document, "frequency_hz")
    if limit_hz is None:
        problem = "it found no direction limit within the frequencies played"
        raise UnusableFileError(path, KIND, (problem,), "State the band with --band.")
    if limit_hz <= lowest_hz:
        problem = f"its direction limit of {limit_hz:.1f} Hz is not above the band's lower end of {lowest_hz:g} Hz"
        raise UnusableFileError(path, KIND, (problem,), "State a lower end below it with --band.")
    lower_hz, upper_hz = _read_limit_value(document, "lower_hz"), _read_limit_value(document, "upper_hz")
    interval_text = (
        f"{f'{lower_hz:.1f} Hz' if lower_hz is not None else 'below what was played'} to "
        f"{f'{upper_hz:.1f} Hz' if upper_hz is not None else 'above what was played'}"
    )
    simulated_text = " Its participants were simulated." if document.get("population") != "people" else ""
    return StudyBand(
        (lowest_hz, limit_hz),
        f"The band ends at the direction limit of {path.name}, {limit_hz:.1f} Hz (interval: {interval_text}), a limit "
        f"of that device, cap and task.{simulated_text}",
    )


def _read_limit_value(document: dict[str, Any], key: str) -> float | None:
    """Read a value of the direction limit in the document; None where it is missing or no positive, finite number."""
    primary = document.get("primary")
    limit = primary.get("limit") if isinstance(primary, dict) else None
    value = limit.get(key) if isinstance(limit, dict) else None
    is_usable = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value) and value > 0
    return float(value) if is_usable and value is not None else None
