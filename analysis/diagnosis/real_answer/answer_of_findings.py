"""The findings on one real recording as plain values."""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.effect_words import parameters_text
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.localisation.localisation_words import localisation_sentences
from analysis.diagnosis.real_answer.real_answer import DrawnExcerpt, HeldOutStretch, OwnParameter, RealAnswer
from analysis.diagnosis.result.candidate_wording import candidate_sentences
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


def answer_of_findings(
    findings: Findings,
    recording: Recording,
    names: tuple[str, str, str],
    nominal: Mapping[str, float],
) -> RealAnswer:
    """The answer to a real recording from the findings of its diagnosis. names: of folder, recording and what it is.
    What only the caller knows (further tests, a pair, objections, the time it took) is left empty."""
    diagnosis, box = findings.diagnosis, findings.black_box
    folder, recording_name, title = names
    return RealAnswer(
        folder=folder,
        recording=recording_name,
        title=title,
        device=recording.device,
        verdict=diagnosis.verdict,
        answer=write_answer(findings),
        model=model_sentence(findings),
        error=diagnosis.error,
        fitted=diagnosis.fit.fit,
        held_out=diagnosis.fit.test,
        black_box=None if box is None or not np.isfinite(box.test_error) else box.test_error,
        where=localisation_sentences(findings.localisation) if findings.maps else (),
        named=describe_named(findings),
        effects=tuple(effect.effect for effect in diagnosis.effects),
        left=describe_remainder(diagnosis, extract_device(findings)),
        remarks=findings.remarks,
        numbers=own_parameters(findings, nominal),
        stretches=held_out_stretches(findings.time_series),
        excerpt=drawn_excerpt(findings.time_series),
        further=(),
        pair=None,
        objections=(),
        seconds=0.0,
        candidates=diagnosis.candidates,
        not_confirmed=candidate_sentences(diagnosis, extract_device(findings)),
    )


def describe_named(findings: Findings) -> tuple[str, ...]:
    """Each effect with its parameters, and what these data cannot tell from it."""
    single = findings.given.inputs == 1
    return tuple(
        " ".join(
            filter(
                None,
                (
                    f"{capitalise(format_effect_title(effect, single))}, "
                    f"{parameters_text(effect.effect, effect.parameters)}.",
                    describe_equivalents(effect),
                ),
            )
        )
        for effect in findings.diagnosis.effects
    )


def model_sentence(findings: Findings) -> str:
    """Sentence on the given model: its name, numbers of coordinates, commands and responses, and quantity."""
    model = findings.given
    bodies = "one body" if model.coordinates == 1 else f"{model.coordinates} bodies or modes"
    commands = "one command" if model.inputs == 1 else f"{model.inputs} commands"
    responses = "one response" if model.outputs == 1 else f"{model.outputs} responses"
    return f"{capitalise(model.name)}: linear, {bodies}, {commands}, {responses} ({model.quantity})."


def held_out_stretches(time_series: Sequence[TimeSeries]) -> tuple[HeldOutStretch, ...]:
    """Each held-out stretch by channel, with its times in s and three rms values: of the signal about its mean, and of
    the errors of the re-tuned and the completed model. Stretches without finite values are left out."""
    stretches = []
    for series in time_series:
        for start, stop in series.tested:
            samples = slice(start, stop)
            for c, channel in enumerate(series.channels):
                measured = series.measured[samples, c]
                is_measured = np.isfinite(measured)
                if not is_measured.any():
                    continue
                sizes = [
                    float(np.sqrt(np.mean((measured - reference)[is_measured] ** 2)))
                    for reference in (
                        measured[is_measured].mean(),
                        series.retuned[samples, c],
                        series.after[samples, c],
                    )
                ]
                times = start / series.sample_rate_hz, stop / series.sample_rate_hz
                if np.isfinite(sizes).all():
                    stretches.append(HeldOutStretch(series.name, channel, series.units[c], *times, *sizes))
    return tuple(stretches)


EXCERPT_SAMPLES = 900
"""Samples of an excerpt, around where re-tuned and final prediction differ most."""


def drawn_excerpt(time_series: Sequence[TimeSeries]) -> DrawnExcerpt | None:
    """At most `EXCERPT_SAMPLES` held-out samples of a channel, about where the completed model departs most from the
    re-tuned model; None without held-out data."""
    stretches = [(series, *ends) for series in time_series for ends in series.tested]
    if not stretches:
        return None
    series, first, last = max(stretches, key=lambda stretch: float(_change(*stretch).max(initial=0.0)))
    change = _change(series, first, last)
    peak_index, c = divmod(int(np.argmax(change)), change.shape[1])
    start = max(min(first + peak_index - EXCERPT_SAMPLES // 2, last - EXCERPT_SAMPLES), first)
    samples = slice(start, min(start + EXCERPT_SAMPLES, last))
    measured, retuned, after = (
        tuple(np.nan_to_num(values_of[samples, c]).tolist())
        for values_of in (series.measured, series.retuned, series.after)
    )
    step_s = 1 / series.sample_rate_hz
    return DrawnExcerpt(
        series.name, series.channels[c], series.units[c], start * step_s, step_s, measured, retuned, after
    )


def _change(series: TimeSeries, start: int, stop: int) -> FloatArray:
    """(samples, c): how far the found effects move the prediction, as a share of the channel's rms."""
    size = np.maximum(np.nanstd(series.measured, axis=0), np.finfo(float).tiny)
    return np.asarray(np.nan_to_num(np.abs(series.retuned - series.after)[start:stop] / size))


def own_parameters(findings: Findings, nominal: Mapping[str, float]) -> tuple[OwnParameter, ...]:
    """Mass, damping and stiffness of the re-tuned model with their 95 % intervals, where it has one body; else empty.
    nominal: values known by other means, by these words, in SI.

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
    after = findings.explanation.after
    error_ratio = max(after.score.worst_channel, 1.0)
    return _parameters(
        tuning, model, tuning.values(after.fitted.deviations), findings.own_errors * error_ratio, nominal
    )


def _parameters(
    tuning: Tuning, model: MechanicalModel, changes: FloatArray, errors: FloatArray, nominal: Mapping[str, float]
) -> tuple[OwnParameter, ...]:
    nominal_values = (model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0])
    names = ("mass", "damping", "stiffness")
    rows = zip(names, nominal_values, tuning.units, changes, errors, strict=False)
    return tuple(
        _compare_parameter(name, unit, float(start + change), float(error), nominal)
        for name, start, unit, change, error in rows
    )


def _compare_parameter(name: str, unit: str, value: float, error: float, nominal: Mapping[str, float]) -> OwnParameter:
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
