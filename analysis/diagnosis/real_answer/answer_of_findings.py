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
    answer_of,
    device_of,
    effect_title,
    inseparable_sentence,
    remainder_sentence,
)
from analysis.wording import capitalise
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_REACH = 1.96
"""Standard errors of half a 95 % interval (normal distribution)."""


def answer_of_findings(
    found: Findings,
    recording: Recording,
    names: tuple[str, str, str],
    nominal: Mapping[str, float],
) -> RealAnswer:
    """The answer to a real recording from the findings of its diagnosis. names: of folder, recording and what it is.
    What only the caller knows (further tests, a pair, objections, the time it took) is left empty."""
    diagnosis, box = found.diagnosis, found.black_box
    folder, recording_name, title = names
    return RealAnswer(
        folder=folder,
        recording=recording_name,
        title=title,
        device=recording.device,
        verdict=diagnosis.verdict,
        answer=answer_of(found),
        model=model_sentence(found),
        error=diagnosis.error,
        fitted=diagnosis.fit.fit,
        held_out=diagnosis.fit.test,
        black_box=None if box is None or not np.isfinite(box.test) else box.test,
        where=localisation_sentences(found.local) if found.maps else (),
        named=describe_named(found),
        effects=tuple(effect.effect for effect in diagnosis.effects),
        left=remainder_sentence(diagnosis, device_of(found)),
        remarks=found.remarks,
        numbers=own_parameters(found, nominal),
        stretches=held_out_stretches(found.time_series),
        excerpt=drawn_excerpt(found.time_series),
        further=(),
        pair=None,
        objections=(),
        seconds=0.0,
        candidates=diagnosis.candidates,
        not_confirmed=candidate_sentences(diagnosis, device_of(found)),
    )


def describe_named(found: Findings) -> tuple[str, ...]:
    """Each effect with its parameters, and what these data cannot tell from it."""
    single = found.given.inputs == 1
    return tuple(
        " ".join(
            filter(
                None,
                (
                    f"{capitalise(effect_title(effect, single))}, {parameters_text(effect.effect, effect.parameters)}.",
                    inseparable_sentence(effect),
                ),
            )
        )
        for effect in found.diagnosis.effects
    )


def model_sentence(found: Findings) -> str:
    """Sentence on the given model: its name, numbers of coordinates, commands and responses, and quantity."""
    given = found.given
    bodies = "one body" if given.coordinates == 1 else f"{given.coordinates} bodies or modes"
    driven = "one command" if given.inputs == 1 else f"{given.inputs} commands"
    seen = "one response" if given.outputs == 1 else f"{given.outputs} responses"
    return f"{capitalise(given.name)}: linear, {bodies}, {driven}, {seen} ({given.quantity})."


def held_out_stretches(time_series: Sequence[TimeSeries]) -> tuple[HeldOutStretch, ...]:
    """Each held-out stretch by channel, with its times in s and three rms values: of the signal about its mean, and of
    the errors of the re-tuned and the completed model. Stretches without finite values are left out."""
    found = []
    for series in time_series:
        for start, stop in series.tested:
            part = slice(start, stop)
            for c, channel in enumerate(series.channels):
                measured = series.measured[part, c]
                known = np.isfinite(measured)
                if not known.any():
                    continue
                sizes = [
                    float(np.sqrt(np.mean((measured - other)[known] ** 2)))
                    for other in (measured[known].mean(), series.retuned[part, c], series.after[part, c])
                ]
                times = start / series.sample_rate_hz, stop / series.sample_rate_hz
                if np.isfinite(sizes).all():
                    found.append(HeldOutStretch(series.name, channel, series.units[c], *times, *sizes))
    return tuple(found)


DRAWN = 900
"""Samples of an excerpt, around where re-tuned and final prediction differ most."""


def drawn_excerpt(time_series: Sequence[TimeSeries]) -> DrawnExcerpt | None:
    """At most `DRAWN` held-out samples of a channel, about where the completed model departs most from the re-tuned
    model; None without held-out data."""
    stretches = [(series, *ends) for series in time_series for ends in series.tested]
    if not stretches:
        return None
    series, first, last = max(stretches, key=lambda stretch: float(_change(*stretch).max(initial=0.0)))
    changed = _change(series, first, last)
    at, c = divmod(int(np.argmax(changed)), changed.shape[1])
    begin = max(min(first + at - DRAWN // 2, last - DRAWN), first)
    part = slice(begin, min(begin + DRAWN, last))
    measured, retuned, after = (
        tuple(np.nan_to_num(values_of[part, c]).tolist())
        for values_of in (series.measured, series.retuned, series.after)
    )
    step_s = 1 / series.sample_rate_hz
    return DrawnExcerpt(
        series.name, series.channels[c], series.units[c], begin * step_s, step_s, measured, retuned, after
    )


def _change(series: TimeSeries, start: int, stop: int) -> FloatArray:
    """(samples, c): how far what was found moves the prediction, as a share of the channel's rms."""
    size = np.maximum(np.nanstd(series.measured, axis=0), np.finfo(float).tiny)
    return np.asarray(np.nan_to_num(np.abs(series.retuned - series.after)[start:stop] / size))


def own_parameters(found: Findings, nominal: Mapping[str, float]) -> tuple[OwnParameter, ...]:
    """Mass, damping and stiffness of the re-tuned model with their 95 % intervals, where it has one body; else empty.
    nominal: values known by other means, by these words, in SI.

    The intervals are those at the end of the search, on the samples that were fitted. Where the residual exceeds the
    noise they are widened by the ratio of both in the worst channel: a slightly wrong law shifts the other parameters.
    """
    model, tuning = found.given, found.tuning
    if model.coordinates != 1 or found.explanation.statistic is not None or tuning is None or found.own_errors is None:
        return ()
    after = found.explanation.after
    wide = max(after.score.worst_channel, 1.0)
    return _parameters(tuning, model, tuning.values(after.fitted.deviations), found.own_errors * wide, nominal)


def _parameters(
    tuning: Tuning, model: MechanicalModel, changes: FloatArray, errors: FloatArray, nominal: Mapping[str, float]
) -> tuple[OwnParameter, ...]:
    given = (model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0])
    words = ("mass", "damping", "stiffness")
    rows = zip(words, given, tuning.units, changes, errors, strict=False)
    return tuple(
        _compare_parameter(name, unit, float(start + by), float(error), nominal)
        for name, start, unit, by, error in rows
    )


def _compare_parameter(name: str, unit: str, value: float, error: float, nominal: Mapping[str, float]) -> OwnParameter:
    reach = _REACH * error
    sure = bool(np.isfinite(reach))
    return OwnParameter(
        name, unit, value, value - reach if sure else None, value + reach if sure else None, nominal.get(name)
    )
