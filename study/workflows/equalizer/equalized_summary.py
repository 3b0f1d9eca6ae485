"""Summary of `hapteq equalize`: how well the computed forces are expected to produce the wanted accelerations.

The same figures as lines for the terminal and as plain values for JSON. Prediction errors are relative to
the wanted signal (rms).
"""

from typing import Any

import numpy as np

from equalizer.plant.model_quality import quality_document, quality_sentence
from equalizer.tracking.feedforward.feedforward import extract_band
from study.workflows.equalizer.equalize_trajectory import EqualizedTrajectory

WORTH_SAYING = 0.01
"""Fraction (rms) of the wanted signal, or of the forces, outside the band above which it is mentioned."""


def summary(done: EqualizedTrajectory) -> dict[str, Any]:
    """The figures as plain values; units by the suffix of a key, errors as fractions."""
    feedforward, bands, compensation = done.feedforward, done.bands, done.compensation
    values: dict[str, Any] = {
        "forces": str(done.plan.out),
        "quality": quality_document(done.models.quality),
        "quality_of_models": [quality_document(model.quality) for model in done.models.all_models],
        "band_hz": list(done.models.band_hz),
        "predicted_error": predicted_error(done),
        "left_out": feedforward.out_of_band_share,
        "peak_n": done.peaks.peak_n,
        "cap_n": done.peaks.cap_n,
        "capped": None,
        "place_m": list(done.models.at.place_m),
        "remarks": [*done.models.held_out, *done.models.remarks],
    }
    if feedforward.loss is not None:
        values["capped"] = {
            "error_free": feedforward.loss.error_free,
            "error_capped": feedforward.loss.error_capped,
            "error_clipped": feedforward.loss.error_clipped,
        }
    values |= _interpolation_facts(done)
    if bands is not None:
        values["bands"] = {
            "edges_hz": list(bands.edges_hz),
            "middle_error_if_only_cut": bands.cut_error,
            "middle_error_with_run_in": bands.whole_error,
            "high_level_error": bands.level_error,
            "high_direction": list(bands.direction),
            "travel_m": bands.travel_m,
        }
    if compensation is not None:
        values["compensated"] = [effect.kind for effect in compensation.used]
        values["not_compensated"] = {effect.kind: reason for effect, reason in compensation.not_used}
        values["compensated_share"] = compensation.share
    return values


def _interpolation_facts(done: EqualizedTrajectory) -> dict[str, Any]:
    """How the models were interpolated, and the errors of both methods at held-out places; empty without a choice."""
    choice = done.models.choice
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


def summary_lines(done: EqualizedTrajectory) -> tuple[str, ...]:
    """The figures as terminal lines."""
    feedforward = done.feedforward
    lines = [*_quality_lines(done), *done.models.held_out, _prediction_line(done), *done.models.remarks]
    lines += _band_lines(done)
    if feedforward.out_of_band_share > WORTH_SAYING:
        lines.append(
            f"{100 * feedforward.out_of_band_share:.0f} % of the wanted acceleration (rms) lies outside the "
            f"{'bands' if done.bands else 'band'} and is not played."
        )
    if feedforward.loss is not None and done.bands is None and (outside := _force_outside(done)) > WORTH_SAYING:
        lines.append(
            f"Forces that are held at the cap have corners: {100 * outside:.0f} % of them (rms) lies outside the "
            "band, where the model does not describe the device's response."
        )
    lines += _physics_lines(done)
    lines.append(_spring_line(done))
    return tuple(lines)


def _quality_lines(done: EqualizedTrajectory) -> list[str]:
    """Measured quality of the models, before their own prediction."""
    models = done.models
    worst_quality = models.quality
    if len(models.all_models) == 1:
        return [quality_sentence(worst_quality), *(worst_quality.remarks if worst_quality else ())]
    position = "narrower" if models.two_bands is not None else "nearest"
    nearest, worst = models.nearest.quality, worst_quality
    lines = [f"Of the {position} model: {quality_sentence(nearest)}"]
    if worst != nearest:
        lines.append(f"Of the worst of the {len(models.all_models)} models: {quality_sentence(worst)}")
    return [*lines, *dict.fromkeys(remark for quality in (nearest, worst) if quality for remark in quality.remarks)]


def predicted_error(done: EqualizedTrajectory) -> float:
    """Relative error as the model predicts it. Under an active cap it includes the corners of the capped forces, so
    that it can be compared with the error without a cap."""
    loss = done.feedforward.loss
    return done.feedforward.error if loss is None else loss.error_capped


def _prediction_line(done: EqualizedTrajectory) -> str:
    """Predicted error, what the cap adds to it, and the highest force."""
    loss, (low, high) = done.feedforward.loss, done.models.band_hz
    subject = "the model itself predicts" if len(done.models.all_models) == 1 else "the models themselves predict"
    cost = ""
    if loss is not None:
        cost = (
            f" under the cap, {100 * loss.error_free:.2f} % without it (clipping would have given "
            f"{100 * loss.error_clipped:.2f} %)"
        )
    return (
        f"As {subject}: error {100 * predicted_error(done):.2f} % of the wanted acceleration within {low:g} to "
        f"{high:g} Hz{cost}; highest force {done.peaks.peak_n:.3g} N of {done.peaks.cap_n:g} N."
    )


def _force_outside(done: EqualizedTrajectory) -> float:
    """Fraction (rms) of the forces outside the model's band."""
    forces = done.forces.signal.samples
    outside = forces - extract_band(done.models.nearest, forces)
    return float(np.linalg.norm(outside) / np.linalg.norm(forces))


def _band_lines(done: EqualizedTrajectory) -> list[str]:
    """Edges and errors of the three bands; empty where a single band was solved for."""
    bands, two_bands = done.bands, done.models.two_bands
    if bands is None or two_bands is None:
        return []
    low, high = bands.edges_hz
    lines = [
        f"Bands: a rigid model below {low:g} Hz (the handle travels {1e3 * bands.travel_m:.1f} mm), the narrower "
        f"model up to {high:g} Hz, from there to {two_bands.wide.band_hz[1]:g} Hz only the loudness is reproduced, all "
        "along one direction.",
        "The bands begin before the table's first row and end after its last; only its rows are written, and the "
        f"middle band is solved for them. Its error would be {100 * bands.whole_error:.2f} % if all rows were "
        f"played, and {100 * bands.cut_error:.2f} % if the other rows were simply cut off.",
    ]
    if bands.level_error is not None:
        lines.append(
            f"Loudness of the high band, compared sixth by sixth of an octave: {100 * bands.level_error:.1f} % off."
        )
    return lines


def _physics_lines(done: EqualizedTrajectory) -> list[str]:
    """Nonlinear effects that were compensated, and those that were not, with the reason."""
    compensation = done.compensation
    if compensation is None:
        return []
    share = f"; {100 * compensation.share:.0f} % of it fits under the cap" if compensation.share < 1 else ""
    used = ", ".join(effect.kind for effect in compensation.used) or "nothing"
    lines = [f"Compensated: {used}{share}."]
    return lines + [f"Not compensated: {effect.kind}: {reason}." for effect, reason in compensation.not_used]


def _spring_line(done: EqualizedTrajectory) -> str:
    """Whether the forces include those of a virtual spring, which depends on the model's input."""
    if done.models.nearest.provenance.get("input") == "excitation":
        return "These forces are for the device under the spring that it was recorded with."
    return "These forces are all that enters the device: a spring that holds the handle is not counted."
