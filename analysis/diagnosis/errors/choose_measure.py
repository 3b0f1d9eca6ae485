"""Make the error measure for recordings and a model, by the rule of `error_measure_rule` or by the user's choice.

In this order, unless forces are requested: the samples of each recording are divided into those to fit, to choose and
to test by; the noise of each channel is estimated; errors get their unit from the noise and the signal
(`compute_error_units`); the rule selects free simulation, windows or forces. Begin at `make_measure`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.data.observed import Observed, compute_error_units
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.error_measure_rule import (
    UNTIMED,
    RuleChoice,
    count_samples_to_omit,
    select_error_measure,
)
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.limits import UNKNOWN_NOISE_SHARE
from analysis.diagnosis.noise.noise_floor import NoiseFloor, choose_least_noise, estimate_noise_floor
from analysis.diagnosis.noise.rounding import find_rounding_step
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.placing import place_recorded_effects
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

Compared = Literal["auto", "motion", "force"]
"""Signals that the user sets to be compared; auto: by the rule."""

LEAST_DITHER = 0.02
"""Rms noise over the step of a converter, up to which differences between repeats do not show the noise. Chosen by
hand."""
UNTIMED_BAND_SHARE = 0.45
"""End of the band relative to the sample rate, for samples without a time axis: below half the rate. Chosen by hand."""
FORCE_REMARK = (
    "The force that the model needs along the measured motion is compared with the force that was applied: the "
    "motion was measured, and small errors of a model that was fitted to it would grow in a simulation."
)
REQUESTED_MOTION_REMARK = (
    "As requested, the motion is compared in short windows, each from a state estimated from the measured motion; "
    "the automatic choice would have compared forces."
)
NO_STATE_REMARK = (
    "Short windows would be suitable, but the sensors do not show the model's state, so it was simulated from rest; "
    "errors may grow with time."
)
NO_STATE_FORCE_REMARK = (
    "Short windows would be suitable, but the sensors do not show the model's state: the force that the model needs "
    "along the measured motion is compared with the force that was applied."
)
"""Remarks for the user on the chosen measure; those of the rule are in `error_measure_rule`."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasureChoice:
    """The chosen error measure with the noise of its signals, and remarks for the user."""

    measure: ErrorMeasure
    floors: tuple[NoiseFloor, ...]
    """Noise of the compared signals, per record of the measure."""
    remarks: tuple[str, ...]
    """Sentences on the choice, and on the effects that the model itself names."""


def make_measure(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    companions: Sequence[Recording] = (),
    compared: Compared = "auto",
) -> MeasureChoice:
    """Make the error measure that the rule or `compared` selects. companions: further recordings that must suit the
    same measure but are not part of it. Where the state for windows cannot be estimated, forces are compared; if motion
    was requested or none was measured, a free simulation."""
    if compared == "force":
        return make_force_measure(recordings, model, None)
    records, companion_records = (
        tuple(_exclude_transient(record, model) for record in observe_parts(group, model.outputs)) if group else ()
        for group in (recordings, companions)
    )
    floors = tuple(estimate_noise_floor(record.recording) for record in records)
    noise = _estimate_noise(floors, records)
    unit = compute_error_units(np.vstack([record.measured for record in records]), noise)
    choice = select_error_measure((*records, *companion_records), model)
    if compared == "motion" and choice.measure == "predicted force":
        choice = RuleChoice("windows", REQUESTED_MOTION_REMARK)
    model_effects = place_recorded_effects(model, recordings[0])
    remarks = (*((choice.reason,) if choice.reason else ()), *_describe_model_effects(model_effects))
    if choice.measure == "free simulation":
        return MeasureChoice(FreeSimulation(records, unit, noise, model_effects=model_effects), floors, remarks)
    if choice.measure == "windows":
        # Imported here, as in `_build_force_measure`: most diagnoses compare a free simulation.
        from analysis.diagnosis.errors.windows import build_windows

        try:
            windows = replace(build_windows(records, model, (unit, noise)), model_effects=model_effects)
            return MeasureChoice(windows, floors, remarks)
        except np.linalg.LinAlgError:
            if compared == "motion" or not all(has_motion(record.recording, model) for record in records):
                return MeasureChoice(
                    FreeSimulation(records, unit, noise, model_effects=model_effects),
                    floors,
                    (NO_STATE_REMARK, *_describe_model_effects(model_effects)),
                )
            remarks = (NO_STATE_FORCE_REMARK, *_describe_model_effects(model_effects))
    band_hz = UNTIMED_BAND_SHARE * recordings[0].sample_rate_hz if choice.reason == UNTIMED else None
    return _build_force_measure(records, model, floors, remarks, band_hz)


def make_force_measure(recordings: Sequence[Recording], model: MechanicalModel, band_hz: float | None) -> MeasureChoice:
    """Make the error measure by force without the rule. band_hz: upper end of the band in which forces are compared;
    None = by the noise. The recordings must have a motion (`has_motion`)."""
    records = observe_parts(recordings, model.outputs)
    model_effects = place_recorded_effects(model, recordings[0])
    floors = [estimate_noise_floor(record.recording) for record in records]
    return _build_force_measure(
        records, model, floors, (FORCE_REMARK, *_describe_model_effects(model_effects)), band_hz
    )


def _build_force_measure(
    records: Sequence[Observed],
    model: MechanicalModel,
    floors: Sequence[NoiseFloor],
    remarks: tuple[str, ...],
    band_hz: float | None = None,
) -> MeasureChoice:
    """Build the error measure by force, with the end of its band among the remarks (except `UNTIMED`)."""
    from analysis.diagnosis.forces.force_measure import build_predicted_force_measure

    model_effects = place_recorded_effects(model, records[0].recording)
    force_measure = build_predicted_force_measure(records, model, floors, band_hz)
    band_remark = "" if UNTIMED in remarks else f"The forces are compared up to {force_measure.measure.band_hz:.3g} Hz."
    return MeasureChoice(
        replace(force_measure.measure, model_effects=model_effects),
        force_measure.floors,
        tuple(filter(None, (*remarks, band_remark))),
    )


def _describe_model_effects(model_effects: Sequence[PlacedEffect]) -> tuple[str, ...]:
    """Describe the effects that the model's file names, in one remark; empty without any."""
    if not model_effects:
        return ()
    effect_nouns = ", ".join(dict.fromkeys(get_noun(placed_effect.effect.name) for placed_effect in model_effects))
    return (f"The given model contains these effects, which are part of every simulation: {effect_nouns}.",)


def _exclude_transient(record: Observed, model: MechanicalModel) -> Observed:
    """Remove the samples of the initial motion from all three sets, where that motion decays soon
    (`count_samples_to_omit`)."""
    first_settled_sample = count_samples_to_omit(record, model)
    if not first_settled_sample:
        return record
    is_settled = np.arange(len(record.command)) >= first_settled_sample
    return replace(
        record, fit=record.fit & is_settled, choose=record.choose & is_settled, test=record.test & is_settled
    )


def _estimate_noise(floors: Sequence[NoiseFloor], records: Sequence[Observed]) -> FloatArray:
    """Estimate (c,): rms noise of each channel (`choose_least_noise`); `UNKNOWN_NOISE_SHARE` of the rms signal where
    unknown or 0."""
    channel_count = records[0].measured.shape[1]
    noise_by_record = [
        np.concatenate(
            [_subtract_rounding_noise(floor, record), floor.position_rms if floor.position_rms is not None else []]
        )[:channel_count]
        for floor, record in zip(floors, records, strict=True)
    ]
    signal_rms = np.sqrt(np.nanmean(np.vstack([record.measured for record in records]) ** 2, axis=0))
    least_noise = choose_least_noise(noise_by_record, [record.measured for record in records])
    return np.asarray(
        np.where(np.isfinite(least_noise) & (least_noise > 0), least_noise, UNKNOWN_NOISE_SHARE * signal_rms)
    )


def _subtract_rounding_noise(floor: NoiseFloor, record: Observed) -> FloatArray:
    """Compute (p,): rms noise of the response before a converter rounded it (rounding adds step² / 12), because
    quantisation is an effect that the model may lack. Positions keep their rounding, which every encoder has. Noise
    that was not estimated from repeats is unchanged, because it cannot be separated from rounding; so is noise of which
    no more than `LEAST_DITHER` steps would remain."""
    rms_noise = floor.response_rms
    if floor.method != "repeats":
        return rms_noise
    steps = np.array([find_rounding_step(record.measured[:, channel]) for channel in range(len(rms_noise))])
    unrounded_noise = np.asarray(np.sqrt(np.maximum(rms_noise**2 - steps**2 / 12, 0.0)))
    return np.where(unrounded_noise > LEAST_DITHER * steps, unrounded_noise, rms_noise)
