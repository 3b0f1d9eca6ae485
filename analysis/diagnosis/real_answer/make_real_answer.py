"""Convert the findings on one real recording to the document `RealAnswer`, for the report on real recordings."""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.effect_words import format_parameters
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.localisation.localisation_words import write_localisation_sentences
from analysis.diagnosis.real_answer.real_answer import DrawnExcerpt, HeldOutStretch, OwnParameter, RealAnswer
from analysis.diagnosis.result.candidate_wording import describe_candidates
from analysis.diagnosis.result.findings import Findings, TimeSeries
from analysis.diagnosis.result.wording import (
    describe_equivalents,
    describe_remainder,
    extract_device,
    format_effect_title,
    write_answer,
)
from analysis.wording import capitalise
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_HALF_WIDTH_95 = 1.96
"""Standard errors of half a 95 % interval (normal distribution)."""


def make_real_answer(
    findings: Findings,
    recording: Recording,
    names: tuple[str, str, str],
    nominal: Mapping[str, float],
) -> RealAnswer:
    """Make the document of a real recording from the findings of its diagnosis. names: folder, recording, title.
    nominal: parameters known by other means, in SI (see `list_model_parameters`). Fields that only the caller can
    fill (further tests, a pair, objections, duration) are left empty."""
    diagnosis, black_box = findings.diagnosis, findings.black_box
    folder, recording_name, title = names
    return RealAnswer(
        folder=folder,
        recording=recording_name,
        title=title,
        device=recording.device,
        verdict=diagnosis.verdict,
        answer=write_answer(findings),
        model=describe_model(findings),
        error=diagnosis.error,
        fitted=diagnosis.fit.fit,
        held_out=diagnosis.fit.test,
        black_box=None if black_box is None or not np.isfinite(black_box.test_error) else black_box.test_error,
        where=write_localisation_sentences(findings.localisation) if findings.maps else (),
        named=describe_named_effects(findings),
        effects=tuple(effect.effect for effect in diagnosis.effects),
        left=describe_remainder(diagnosis, extract_device(findings)),
        remarks=findings.remarks,
        numbers=list_model_parameters(findings, nominal),
        stretches=list_held_out_stretches(findings.time_series),
        excerpt=select_excerpt(findings.time_series),
        further=(),
        pair=None,
        objections=(),
        seconds=0.0,
        candidates=diagnosis.candidates,
        not_confirmed=describe_candidates(diagnosis, extract_device(findings)),
    )


def describe_named_effects(findings: Findings) -> tuple[str, ...]:
    """Describe each named effect: its parameters, and the effects that these data cannot distinguish from it."""
    is_single_axis = findings.given.inputs == 1
    return tuple(
        " ".join(
            filter(
                None,
                (
                    f"{capitalise(format_effect_title(effect, is_single_axis))}, "
                    f"{format_parameters(effect.effect, effect.parameters)}.",
                    describe_equivalents(effect),
                ),
            )
        )
        for effect in findings.diagnosis.effects
    )


def describe_model(findings: Findings) -> str:
    """Describe the given model in a sentence: its name, numbers of coordinates, commands and responses, and
    quantity."""
    model = findings.given
    bodies_text = "one body" if model.coordinates == 1 else f"{model.coordinates} bodies or modes"
    commands_text = "one command" if model.inputs == 1 else f"{model.inputs} commands"
    responses_text = "one response" if model.outputs == 1 else f"{model.outputs} responses"
    return f"{capitalise(model.name)}: linear, {bodies_text}, {commands_text}, {responses_text} ({model.quantity})."


def list_held_out_stretches(time_series: Sequence[TimeSeries]) -> tuple[HeldOutStretch, ...]:
    """List the held-out stretches by channel, with its times in s and three rms values: of the signal about its mean,
    and of the errors of the re-tuned and the completed model. Channels without readings in a stretch, or with
    predictions that are not finite there, are left out."""
    stretches = []
    for series in time_series:
        for start, stop in series.tested:
            samples = slice(start, stop)
            for channel_index, channel in enumerate(series.channels):
                measured = series.measured[samples, channel_index]
                is_measured = np.isfinite(measured)
                if not is_measured.any():
                    continue
                rms_values = [
                    float(np.sqrt(np.mean((measured - reference)[is_measured] ** 2)))
                    for reference in (
                        measured[is_measured].mean(),
                        series.retuned[samples, channel_index],
                        series.after[samples, channel_index],
                    )
                ]
                times_s = start / series.sample_rate_hz, stop / series.sample_rate_hz
                if np.isfinite(rms_values).all():
                    stretches.append(
                        HeldOutStretch(series.name, channel, series.units[channel_index], *times_s, *rms_values)
                    )
    return tuple(stretches)


EXCERPT_SAMPLES = 900
"""Largest number of samples of an excerpt. Chosen by hand."""


def select_excerpt(time_series: Sequence[TimeSeries]) -> DrawnExcerpt | None:
    """Select at most `EXCERPT_SAMPLES` held-out samples of a channel, about where the completed model departs most from
    the re-tuned model; None without held-out data."""
    stretches = [(series, *bounds) for series in time_series for bounds in series.tested]
    if not stretches:
        return None
    series, first_sample, end_sample = max(
        stretches, key=lambda stretch: float(_compute_relative_change(*stretch).max(initial=0.0))
    )
    relative_change = _compute_relative_change(series, first_sample, end_sample)
    peak_index, channel_index = divmod(int(np.argmax(relative_change)), relative_change.shape[1])
    start = max(min(first_sample + peak_index - EXCERPT_SAMPLES // 2, end_sample - EXCERPT_SAMPLES), first_sample)
    samples = slice(start, min(start + EXCERPT_SAMPLES, end_sample))
    measured, retuned, completed = (
        tuple(np.nan_to_num(signal[samples, channel_index]).tolist())
        for signal in (series.measured, series.retuned, series.after)
    )
    step_s = 1 / series.sample_rate_hz
    return DrawnExcerpt(
        series.name,
        series.channels[channel_index],
        series.units[channel_index],
        start * step_s,
        step_s,
        measured,
        retuned,
        completed,
    )


def _compute_relative_change(series: TimeSeries, start: int, stop: int) -> FloatArray:
    """Compute (samples, c): change of the prediction by the named effects, relative to the channel's standard
    deviation; 0 where not finite. start, stop: samples."""
    channel_std = np.maximum(np.nanstd(series.measured, axis=0), np.finfo(float).tiny)
    return np.asarray(np.nan_to_num(np.abs(series.retuned - series.after)[start:stop] / channel_std))


def list_model_parameters(findings: Findings, nominal: Mapping[str, float]) -> tuple[OwnParameter, ...]:
    """List mass, damping and stiffness of the re-tuned model with 95 % intervals. Empty where the model has more than
    one coordinate, band powers were compared, or errors are not known. nominal: values known by other means, in SI, by
    "mass", "damping" and "stiffness".

    The intervals are those at the end of the search, on the samples that were fitted. Where the residual exceeds the
    noise they are widened by the ratio of both in the worst channel: a slightly wrong law shifts the other parameters.
    """
    model, tuning = findings.given, findings.tuning
    if (
        model.coordinates != 1
        or findings.explanation.statistic is not None
        or tuning is None
        or findings.own_errors is None
    ):
        return ()
    final_candidate = findings.explanation.after
    error_ratio = max(final_candidate.score.worst_channel, 1.0)
    return _compare_parameters(
        tuning, model, tuning.to_changes(final_candidate.fitted.deviations), findings.own_errors * error_ratio, nominal
    )


def _compare_parameters(
    tuning: Tuning, model: MechanicalModel, changes: FloatArray, errors: FloatArray, nominal: Mapping[str, float]
) -> tuple[OwnParameter, ...]:
    """Compare mass, damping and stiffness with their nominal values. changes: added to the model's values by re-tuning;
    errors: standard errors; each (parameters,), in `tuning.units`."""
    nominal_values = (model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0])
    names = ("mass", "damping", "stiffness")
    rows = zip(names, nominal_values, tuning.units, changes, errors, strict=False)
    return tuple(
        _compare_parameter(name, unit, float(initial_value + change), float(error), nominal)
        for name, initial_value, unit, change, error in rows
    )


def _compare_parameter(name: str, unit: str, value: float, error: float, nominal: Mapping[str, float]) -> OwnParameter:
    """Return a parameter with its 95 % interval (bounds None where the standard error is not finite) and its nominal
    value (None where unknown)."""
    half_width = _HALF_WIDTH_95 * error
    has_interval = bool(np.isfinite(half_width))
    return OwnParameter(
        name,
        unit,
        value,
        value - half_width if has_interval else None,
        value + half_width if has_interval else None,
        nominal.get(name),
    )
