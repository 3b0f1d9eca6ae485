"""The band of an equalizer from a study: its upper end is the frequency up to which people tell directions apart.

Above the direction limit a direction need not be right, so that a model need not be good there: the narrow band of the
full equalizer ends at it, and a wider model renders the strength alone.
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
"""What messages call such a file."""
ANALYSE = "Give the anova.json that `hapteq analyze` writes for a study with two participants or more."


@dataclass(frozen=True, slots=True)
class BandOfStudy:
    """A frequency band that ends at the direction limit found by a study."""

    band_hz: tuple[float, float]
    origin: str
    """Where the upper end comes from, in a sentence."""


def band_of_study(path: Path, lowest_hz: float) -> BandOfStudy:
    """The band from `lowest_hz` to the direction limit of an analysis. Raises CannotReadError, UnusableFileError."""
    try:
        document = load_json(read_text(path))
    except ValueError as error:
        raise UnusableFileError(path, KIND, (str(error),), ANALYSE) from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise UnusableFileError(path, KIND, (f'"format" is not {json.dumps(FORMAT)}',), ANALYSE)
    limit = _number(document, "frequency_hz")
    if limit is None:
        problem = "it found no direction limit within the frequencies played"
        raise UnusableFileError(path, KIND, (problem,), "State the band with --band.")
    if limit <= lowest_hz:
        problem = f"its direction limit of {limit:.1f} Hz is not above the band's lower end of {lowest_hz:g} Hz"
        raise UnusableFileError(path, KIND, (problem,), "State a lower end below it with --band.")
    lower, upper = _number(document, "lower_hz"), _number(document, "upper_hz")
    interval = (
        f"{f'{lower:.1f} Hz' if lower is not None else 'below what was played'} to "
        f"{f'{upper:.1f} Hz' if upper is not None else 'above what was played'}"
    )
    simulated = " Its participants were simulated." if document.get("population") != "people" else ""
    return BandOfStudy(
        (lowest_hz, limit),
        f"The band ends at the direction limit of {path.name}, {limit:.1f} Hz (interval: {interval}), a limit of that "
        f"device, cap and task.{simulated}",
    )


def _number(document: dict[str, Any], key: str) -> float | None:
    """A positive value of the direction limit in the document; None where it is not given."""
    primary = document.get("primary")
    limit = primary.get("limit") if isinstance(primary, dict) else None
    value = limit.get(key) if isinstance(limit, dict) else None
    usable = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value) and value > 0
    return float(value) if usable and value is not None else None
