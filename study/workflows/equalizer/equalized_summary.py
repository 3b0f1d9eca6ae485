"""Summary of `hapteq equalize`: predicted accuracy of the accelerations that the computed forces produce.

Predicted errors of accelerations are rms errors in the band or, under an active cap, at all frequencies, relative to
the rms of the reference trajectory, the accelerations that the device is to reproduce, in the band.
"""

from typing import Any

import numpy as np

from equalizer.plant.model_quality import convert_quality_to_json, write_quality_sentence
from equalizer.tracking.feedforward.feedforward import extract_band
from study.workflows.equalizer.equalize_trajectory import EqualizedTrajectory

MIN_REPORTED_SHARE = 0.01
"""Fraction (rms) of the reference trajectory, or of the forces, outside the band above which it is reported."""


def summarise_equalization(equalized: EqualizedTrajectory) -> dict[str, Any]:
    """Collect the results as plain values for a JSON document. Units are stated by the suffix of a key; errors and
    shares are fractions, not percentages."""
    feedforward, bands, compensation = equalized.feedforward, equalized.bands, equalized.compensation
    values: dict[str, Any] = {
        "forces": str(equalized.plan.out),
        "quality": convert_quality_to_json(equalized.models.quality),
        "quality_of_models": [convert_quality_to_json(model.quality) for model in equalized.models.all_models],
        "band_hz": list(equalized.models.band_hz),
        "predicted_error": get_predicted_error(equalized),
        "left_out": feedforward.out_of_band_share,
        "peak_n": equalized.peaks.peak_n,
        "cap_n": equalized.peaks.cap_n,
        "capped": None,
        "place_m": list(equalized.models.at_place.place_m),
        "remarks": [*equalized.models.held_out_remarks, *equalized.models.remarks],
    }
    if feedforward.loss is not None:
        values["capped"] = {
            "error_free": feedforward.loss.error_free,
            "error_capped": feedforward.loss.error_capped,
            "error_clipped": feedforward.loss.error_clipped,
        }
    values |= _summarise_interpolation(equalized)
    if bands is not None:
        values["bands"] = {
            "edges_hz": list(bands.edges_hz),
            "middle_error_if_only_cut": bands.cut_error,
            "middle_error_with_run_in": bands.uncut_error,
            "high_level_error": bands.level_error,
            "high_direction": list(bands.direction),
            "travel_m": bands.travel_m,
        }
    if compensation is not None:
        values["compensated"] = [effect.kind for effect in compensation.used]
        values["not_compensated"] = {effect.kind: reason for effect, reason in compensation.not_used}
        values["compensated_share"] = compensation.share
    return values


def _summarise_interpolation(equalized: EqualizedTrajectory) -> dict[str, Any]:
    """Collect the method by which models of several places are interpolated, and the errors of both available methods
    at places left out of the interpolation (leave-one-out cross-validation). Empty where the models are of a single
    place."""
    choice = equalized.models.choice
    if choice is None:
        return {}
    return {
        "interpolation": choice.interpolation,
        "held_out": [
            {
                "place_m": list(check.place_m),
                "blended_held_out_error": check.blended_error,
                "modal_held_out_error": check.modal_error,
            }
            for check in choice.checks
        ],
    }


def format_equalization_lines(equalized: EqualizedTrajectory) -> tuple[str, ...]:
    """Format the results as lines of text for the terminal."""
    feedforward = equalized.feedforward
    lines = [
        *_format_quality_lines(equalized),
        *equalized.models.held_out_remarks,
        _format_prediction_line(equalized),
        *equalized.models.remarks,
    ]
    lines += _format_band_lines(equalized)
    if feedforward.out_of_band_share > MIN_REPORTED_SHARE:
        lines.append(
            f"{100 * feedforward.out_of_band_share:.0f} % of the wanted acceleration (rms) lies outside the "
            f"{'bands' if equalized.bands else 'band'} and is not played."
        )
    if (
        feedforward.loss is not None
        and equalized.bands is None
        and (force_share := _compute_out_of_band_force_share(equalized)) > MIN_REPORTED_SHARE
    ):
        lines.append(
            f"Forces that are held at the cap have corners: {100 * force_share:.0f} % of them (rms) lies outside the "
            "band, where the model does not describe the device's response."
        )
    lines += _format_compensation_lines(equalized)
    lines.append(_describe_spring_force(equalized))
    return tuple(lines)


def _format_quality_lines(equalized: EqualizedTrajectory) -> list[str]:
    """Format lines on the measured quality: of a single model with its remarks; of several models that of the model
    nearest to the place, or of the narrower of two bands, then that of the worst model where it differs, then the
    remarks of both."""
    models = equalized.models
    combined_quality = models.quality
    if len(models.all_models) == 1:
        return [write_quality_sentence(combined_quality), *(combined_quality.remarks if combined_quality else ())]
    model_role = "narrower" if models.two_bands is not None else "nearest"
    nearest_quality, worst_quality = models.nearest.quality, combined_quality
    lines = [f"Of the {model_role} model: {write_quality_sentence(nearest_quality)}"]
    if worst_quality != nearest_quality:
        lines.append(f"Of the worst of the {len(models.all_models)} models: {write_quality_sentence(worst_quality)}")
    return [
        *lines,
        *dict.fromkeys(remark for quality in (nearest_quality, worst_quality) if quality for remark in quality.remarks),
    ]


def get_predicted_error(equalized: EqualizedTrajectory) -> float:
    """Return the relative rms error that the model predicts, in the band; under an active cap that of the capped forces
    at all frequencies (`TrackingLoss.error_capped`)."""
    loss = equalized.feedforward.loss
    return equalized.feedforward.error if loss is None else loss.error_capped


def _format_prediction_line(equalized: EqualizedTrajectory) -> str:
    """Format a line on the predicted error, on what the cap adds to it, and on the peak force (N)."""
    loss, (low_hz, high_hz) = equalized.feedforward.loss, equalized.models.band_hz
    subject = "the model itself predicts" if len(equalized.models.all_models) == 1 else "the models themselves predict"
    cap_text = ""
    if loss is not None:
        cap_text = (
            f", errors at all frequencies counted, under the cap, {100 * loss.error_free:.2f} % without it (clipping "
            "would have given "
            f"{100 * loss.error_clipped:.2f} %)"
        )
    return (
        f"As {subject}: error {100 * get_predicted_error(equalized):.2f} % of the wanted acceleration within "
        f"{low_hz:g} to {high_hz:g} Hz{cap_text}; highest force {equalized.peaks.peak_n:.3g} N of "
        f"{equalized.peaks.cap_n:g} N."
    )


def _compute_out_of_band_force_share(equalized: EqualizedTrajectory) -> float:
    """Compute the fraction (rms) of the forces outside the band of the nearest model; NaN for forces that are all
    zero."""
    forces = equalized.forces.signal.samples
    out_of_band_forces = forces - extract_band(equalized.models.nearest, forces)
    return float(np.linalg.norm(out_of_band_forces) / np.linalg.norm(forces))


def _format_band_lines(equalized: EqualizedTrajectory) -> list[str]:
    """Format lines on the edges (Hz) and errors of the three bands; empty where a single band was solved for."""
    bands, two_bands = equalized.bands, equalized.models.two_bands
    if bands is None or two_bands is None:
        return []
    low_hz, high_hz = bands.edges_hz
    lines = [
        f"Bands: a rigid model below {low_hz:g} Hz (the handle travels {1e3 * bands.travel_m:.1f} mm), the narrower "
        f"model up to {high_hz:g} Hz, from there to {two_bands.wide.band_hz[1]:g} Hz only the loudness is reproduced, "
        "all along one direction.",
        "The bands begin before the table's first row and end after its last; only its rows are written, and the "
        f"middle band is solved for them. Its error would be {100 * bands.uncut_error:.2f} % if all rows were "
        f"played, and {100 * bands.cut_error:.2f} % if the other rows were simply cut off.",
    ]
    if bands.level_error is not None:
        lines.append(
            f"Loudness of the high band, compared sixth by sixth of an octave: {100 * bands.level_error:.1f} % off."
        )
    return lines


def _format_compensation_lines(equalized: EqualizedTrajectory) -> list[str]:
    """Format lines on the nonlinear effects that the forces compensate, and on those that they do not, with the reason;
    empty without compensation."""
    compensation = equalized.compensation
    if compensation is None:
        return []
    share_text = f"; {100 * compensation.share:.0f} % of it fits under the cap" if compensation.share < 1 else ""
    compensated_kinds = ", ".join(effect.kind for effect in compensation.used) or "nothing"
    lines = [f"Compensated: {compensated_kinds}{share_text}."]
    return lines + [f"Not compensated: {effect.kind}: {reason}." for effect, reason in compensation.not_used]


def _describe_spring_force(equalized: EqualizedTrajectory) -> str:
    """Describe whether the forces act together with the virtual spring. For a model from the excitation alone, the
    recording's spring is part of the model; else the forces are the whole command."""
    if equalized.models.nearest.provenance.get("input") == "excitation":
        return "These forces are for the device under the spring that it was recorded with."
    return "These forces are all that enters the device: a spring that holds the handle is not counted."
