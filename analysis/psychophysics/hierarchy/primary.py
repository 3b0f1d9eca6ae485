"""The primary analysis of a study, from its answers to medians, contrasts, spreads and the direction limit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.psychophysics.group_contrasts import Contrast, contrasts, pair_contrast
from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.fit import HierarchicalFit, fit_hierarchy
from analysis.psychophysics.hierarchy.goodness import GoodnessOfFit, goodness_of_fit
from analysis.psychophysics.hierarchy.inference import (
    DirectionLimit,
    MedianThreshold,
    compute_pseudo_thresholds,
    estimate_direction_limit,
    estimate_medians,
)
from analysis.psychophysics.hierarchy.run_likelihood import Nuisance, RunLikelihood, run_likelihoods
from analysis.psychophysics.repeated_measures import RepeatedMeasures, repeated_measures
from equalizer.signals.signal import FloatArray
from protocols.procedure.staircase import to_db

CONFIDENCE = 0.95
"""Default confidence of all intervals."""
FAR_ABOVE_DB = 6.0
"""Of two medians that both lie this far above the cap no difference is reported: the right answers are hardly more than
chance at all levels, the sizes are extrapolated, and their differences have no known error."""
FAR_ABOVE_NOTE = "Two medians or more lie at more than twice the cap: their differences are not known."


@dataclass(frozen=True, slots=True)
class PersonEstimate:
    """One person's parameters, shrunk towards the population's where their own answers say little (posterior mode)."""

    subject: str
    thresholds_n: tuple[float, ...]
    """At each frequency; above the cap, only an extrapolation that the answers do not contradict."""
    above_cap: tuple[bool, ...]
    slope: float
    criterion: float
    """c in units of d', positive for a tendency to answer 2."""


@dataclass(frozen=True, slots=True)
class PrimaryAnalysis:
    """Estimates of the hierarchical psychometric model."""

    family: Family
    trials: int
    frequencies_hz: tuple[float, ...]
    """Those with answers, in ascending order."""
    confidence: float
    medians: tuple[MedianThreshold, ...]
    overall: RepeatedMeasures
    """Over the pseudo-thresholds in dB."""
    contrasts: tuple[Contrast, ...]
    limit: DirectionLimit
    persons: tuple[PersonEstimate, ...]
    runs: tuple[RunLikelihood, ...]
    """Likelihood of each person's threshold at each frequency, by those answers alone."""
    person_sd_db: float
    """Standard deviation between people, common to all frequencies."""
    frequency_sd_db: float
    """Standard deviation of the interaction person x frequency."""
    slope: float
    slope_log_sd: float
    criterion_sd: float
    lapse: float
    goodness: GoodnessOfFit
    converged: bool
    """Both fits: that of all answers, and that of the analysis of variance where some people are left out of it."""
    missing_hz: tuple[float, ...] = ()
    """Frequencies of the protocol without any answer: the model leaves them out."""
    declared_contrast: Contrast | None = None
    """Result for the protocol's declared pair; None where none is declared, or where it cannot be tested."""
    far_above_hz: tuple[float, ...] = ()
    """Frequencies whose medians lie `FAR_ABOVE_DB` above the cap; two of them have no contrast."""


def primary_analysis(
    answers: Answers | None,
    cap_n: float,
    family: Family = Family.WEIBULL,
    confidence: float = CONFIDENCE,
    declared_hz: Sequence[float] = (),
) -> PrimaryAnalysis | None:
    """Fit the hierarchical model to all answers; None with fewer than two persons or two frequencies with answers.
    declared_hz: the declared contrast's frequencies, first minus second, or none."""
    if answers is None or answers.persons < 2:
        return None
    requested_hz, answers = answers.frequencies_hz, drop_unanswered_frequencies(answers)
    if len(answers.frequencies_hz) < 2:
        return None
    fit = fit_hierarchy(answers, family)
    cap_db, frequencies = to_db(cap_n), answers.frequencies_hz
    parameters, k, sds = fit.parameters, fit.layout.k, np.exp(fit.parameters[fit.layout.log_sds])
    persons = estimate_persons(answers.subjects, np.hstack([fit.latent[:, :-2], fit.shared_means]), cap_db)
    medians, compared = estimate_medians(fit, cap_db, confidence), _compare(fit, cap_db, confidence, declared_hz)
    above_hz = [m.frequency_hz for m in medians if m.above_cap and m.lower_db is not None and m.lower_db > cap_db]
    return PrimaryAnalysis(
        family=family,
        trials=answers.trials,
        frequencies_hz=frequencies,
        confidence=confidence,
        medians=medians,
        overall=compared.overall,
        contrasts=compared.contrasts,
        limit=estimate_direction_limit(frequencies, compute_pseudo_thresholds(fit), cap_db, confidence,
                              answers.has_enough_answers, above_hz),
        persons=persons,
        runs=run_likelihoods(answers, _nuisances(fit, persons), cap_db, family, confidence),
        person_sd_db=float(sds[0]), frequency_sd_db=float(sds[1]),
        slope=float(np.exp(parameters[k + 2])),
        slope_log_sd=float(sds[2]), criterion_sd=float(sds[3]),
        lapse=fit.lapse,
        goodness=goodness_of_fit(fit),
        converged=fit.converged and compared.converged,
        missing_hz=tuple(frequency_hz for frequency_hz in requested_hz if frequency_hz not in frequencies),
        declared_contrast=compared.declared,
        far_above_hz=compared.far_above_hz,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _FrequencyComparison:
    """Differences between frequencies."""

    overall: RepeatedMeasures
    contrasts: tuple[Contrast, ...]
    declared: Contrast | None
    far_above_hz: tuple[float, ...]
    converged: bool
    """Whether the fit of the analysis of variance found its end."""


def _compare(
    fit: HierarchicalFit, cap_db: float, confidence: float, declared_hz: Sequence[float]
) -> _FrequencyComparison:
    frequencies, sufficient, pseudo = (
        fit.answers.frequencies_hz,
        fit.answers.has_enough_answers,
        compute_pseudo_thresholds(fit),
    )
    far_above = fit.means_db > cap_db + FAR_ABOVE_DB
    far_above_hz = tuple(
        frequency_hz for frequency_hz, is_far_above in zip(frequencies, far_above, strict=True) if is_far_above
    )
    # The first is the reference: from one far above the cap, another such has no difference.
    determined = ~(far_above & far_above[0]) | (np.arange(len(far_above)) == 0)
    declared = None
    if not set(declared_hz) <= set(far_above_hz):
        declared = pair_contrast(frequencies, pseudo, declared_hz, confidence, sufficient)
    overall, converged = _test_overall(fit.answers, pseudo, fit.family, far_above)
    return _FrequencyComparison(
        overall=overall,
        contrasts=contrasts(frequencies, pseudo, confidence, sufficient & determined),
        declared=declared,
        far_above_hz=far_above_hz,
        converged=converged,
    )


def _test_overall(
    answers: Answers, pseudo: FloatArray, family: Family, far_above: NDArray[np.bool_]
) -> tuple[RepeatedMeasures, bool]:
    """Analysis of variance within participants, and whether its own fit found its end; none where two medians or more
    lie far above the cap: the difference between these is one of those it tests. Of those without answers at some
    frequency a pseudo-threshold there says nothing: they are left out, and the model is fitted to the others alone."""
    if far_above.sum() > 1:
        empty = repeated_measures((), ())
        return replace(empty, participants=answers.persons, conditions=len(far_above), notes=(FAR_ABOVE_NOTE,)), True
    is_complete: NDArray[np.bool_] = np.asarray(answers.has_enough_answers.all(axis=1))
    values, converged = np.full(pseudo.shape, np.nan), True
    if is_complete.all():
        values = pseudo
    elif is_complete.sum() > 1:
        fit = fit_hierarchy(select_persons(answers, is_complete), family)
        values[is_complete], converged = compute_pseudo_thresholds(fit), fit.converged
    return repeated_measures(answers.subjects, values.tolist()), converged


def select_persons(answers: Answers, chosen: NDArray[np.bool_]) -> Answers:
    """Answers of some of the persons. chosen: (persons,)."""
    k, cells = len(answers.frequencies_hz), chosen[answers.person]
    subjects = tuple(subject for subject, is_chosen in zip(answers.subjects, chosen, strict=True) if is_chosen)
    new_index = np.cumsum(chosen) - 1
    return Answers(
        subjects=subjects,
        frequencies_hz=answers.frequencies_hz,
        run=(new_index[answers.person] * k + answers.run % k)[cells],
        level_db=answers.level_db[cells],
        side=answers.side[cells],
        right=answers.right[cells],
        wrong=answers.wrong[cells],
    )


def _nuisances(fit: HierarchicalFit, persons: Sequence[PersonEstimate]) -> list[Nuisance]:
    """Slope and criterion of each person from all answers."""
    return [
        Nuisance(person.slope, person.criterion, (fit.lapse,), *map(float, errors))
        for person, errors in zip(persons, fit.shared_errors, strict=True)
    ]


def drop_unanswered_frequencies(answers: Answers) -> Answers:
    """The same answers without the frequencies that have none: a mean without data would have no estimate."""
    k = len(answers.frequencies_hz)
    answered, new_index = np.unique(answers.run % k, return_inverse=True)
    frequencies_hz = tuple(answers.frequencies_hz[index] for index in answered)
    return replace(answers, frequencies_hz=frequencies_hz, run=answers.run // k * len(answered) + new_index)


def estimate_persons(subjects: Sequence[str], latent: FloatArray, cap_db: float) -> tuple[PersonEstimate, ...]:
    """Thresholds, slope and criterion of each person. latent: (n, k + 2), thresholds in dB (modes), log-slope and
    criterion (means with the thresholds integrated out)."""
    return tuple(
        PersonEstimate(
            subject=subject,
            thresholds_n=tuple(float(10.0 ** (db / 20.0)) for db in row[:-2]),
            above_cap=tuple(bool(db > cap_db) for db in row[:-2]),
            slope=float(np.exp(row[-2])),
            criterion=float(row[-1]),
        )
        for subject, row in zip(subjects, latent, strict=True)
    )
