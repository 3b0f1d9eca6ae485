"""Quality of an identified model: its errors against measurements, and their text for reports.

`study.workflows.equalizer.identify_model` computes it and stores it with the model; summaries and reports state it
before any figure that the model predicts about itself.
"""

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

NOT_STORED = "No quality is stored with the model: identify it again from its recordings to know its error."
"""Sentence for a model whose file states no quality, and for a session that was equalized with such a model."""


@dataclass(frozen=True, slots=True)
class ModelQuality:
    """Root-mean-square errors in the model's band, as fractions of the response. Raises ValueError for a negative or
    non-finite figure."""

    expected_error: float | None
    """Error of the model against the device, exceeded in 5 % of cases on recordings like these; not smaller than any
    error below except the noise. None = not known, because the fitted lines contain transients or leakage and no record
    was held out."""
    misfit_error: float
    """Error against the fitted lines, beyond their noise."""
    scatter_error: float | None = None
    """Error that the noise of the fitted lines causes in a model without misfit; None = no bootstrap draws were
    made."""
    held_out_error: float | None = None
    """Error of the prediction of a held-out record, that record's noise included; None = there was none."""
    held_out_noise: float | None = None
    """Noise of the held-out record; None = not known."""
    held_out_s: float | None = None
    """Length of the held-out record, s; None = there was none."""
    remarks: tuple[str, ...] = ()
    """Likely causes of the error, as sentences."""

    def __post_init__(self) -> None:
        for name in [field.name for field in fields(self) if field.name != "remarks"]:
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value >= 0):
                raise ValueError(f"{name} is {value}; it must be a number that is not negative")


def summarise_quality(
    misfit_error: float,
    scatter_error: float | None,
    held_out: tuple[float, float | None, float] | None,
    remarks: tuple[str, ...] = (),
    misfit_bound: float | None = 0.0,
) -> ModelQuality:
    """Summarise the errors of a model. The expected error is the root of the summed squares of misfit and scatter, and
    at least the held-out error. held_out: error, noise, and length of the record (s). misfit_bound: upper bound of the
    misfit that the noise of the fitted lines may hide; used in place of a smaller misfit_error. None where no bound is
    known: the expected error is then not known without a held-out error."""
    model_error = float(np.hypot(max(misfit_error, misfit_bound or 0.0), scatter_error or 0.0))
    held_out_error, held_out_noise, held_out_s = held_out or (None, None, None)
    return ModelQuality(
        None if misfit_bound is None and held_out_error is None else max(model_error, held_out_error or 0.0),
        misfit_error,
        scatter_error,
        held_out_error,
        held_out_noise,
        held_out_s,
        remarks,
    )


def write_quality_sentence(quality: ModelQuality | None) -> str:
    """Write the sentence to print before every figure that a model predicts about itself. None: quality not stored. The
    expected error in it includes the held-out error, see `summarise_quality`."""
    if quality is None:
        return NOT_STORED
    if quality.expected_error is None:
        return (
            f"The error of the model is not known (misfit {100 * quality.misfit_error:.2f} % on the fitted lines "
            "beyond their noise): no recording was held out for a test, and without two counted periods of every sweep "
            "the lines contain transients, which hide errors. Record three periods, or a test."
        )
    if quality.held_out_error is None:
        return (
            "No recording was held out for a test; on the lines to which it was fitted, the error of the model is "
            f"{100 * quality.expected_error:.2f} % (misfit {100 * quality.misfit_error:.2f} % beyond their noise)."
        )
    noise_text = "" if quality.held_out_noise is None else f", noise of the record {100 * quality.held_out_noise:.2f} %"
    return (
        f"Measured on {quality.held_out_s or 0:g} s held out for a test, the error of the model is "
        f"{100 * quality.held_out_error:.2f} %{noise_text}; expected error, exceeded in 5 % of cases: "
        f"{100 * quality.expected_error:.2f} %."
    )


def convert_quality_to_json(quality: ModelQuality | None) -> dict[str, Any] | None:
    """Convert the quality to values for JSON output; None = not stored."""
    return None if quality is None else asdict(quality) | {"remarks": list(quality.remarks)}


def write_quality_brief(quality: ModelQuality | None) -> str:
    """Write a short form for a list of models: the held-out error, or the misfit where no record was held out."""
    if quality is None:
        return "quality not stored"
    if quality.held_out_error is None:
        return f"not tested, misfit {100 * quality.misfit_error:.2g} %"
    return f"held-out error {100 * quality.held_out_error:.2g} %"


def find_worst_quality(qualities: tuple[ModelQuality | None, ...]) -> ModelQuality | None:
    """Find the quality with the largest expected error, an unknown one first, of several models; None without models,
    or where the quality of a model is not stored."""
    stored_qualities = [quality for quality in qualities if quality is not None]
    return (
        max(stored_qualities, key=lambda quality: np.inf if quality.expected_error is None else quality.expected_error)
        if len(stored_qualities) == len(qualities) and stored_qualities
        else None
    )
