"""Primary analysis of a study by the hierarchical psychometric model: from all answers to median thresholds, contrasts
between frequencies, standard deviations between persons, and the direction limit.

The cap is the largest force that the staircase may play. n: persons, k: frequencies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.psychophysics.group_contrasts import ROUNDING_DB, Contrast, compute_contrasts, compute_pair_contrast
from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.fit import HierarchicalFit, fit_hierarchy
from analysis.psychophysics.hierarchy.goodness import GoodnessOfFit, compute_goodness_of_fit
from analysis.psychophysics.hierarchy.inference import (
    DirectionLimit,
    MedianThreshold,
    compute_pseudo_thresholds,
    estimate_direction_limit,
    estimate_medians,
)
from analysis.psychophysics.hierarchy.likelihood_thresholds import (
    LikelihoodThreshold,
    Nuisance,
    compute_likelihood_thresholds,
)
from analysis.psychophysics.repeated_measures import RepeatedMeasures, analyse_repeated_measures
from equalizer.signals.signal import FloatArray
from protocols.procedure.staircase import to_db

CONFIDENCE = 0.95
"""Default confidence of all intervals."""
FAR_ABOVE_DB = 6.0
"""Distance of a median above the cap (dB) beyond which it counts as far above. Between two such medians no difference
is reported: correct answers are hardly above chance at all levels, so that both are extrapolated with an unknown
error."""
FAR_ABOVE_NOTE = "Two medians or more lie at more than twice the cap: their differences are not known."


@dataclass(frozen=True, slots=True)
class PersonEstimate:
    """One person's parameters. Each is a posterior estimate, shrunk towards the population's (in `single_persons`, a
    fixed prior's) where the person's own answers carry little information; see `estimate_persons`."""

    subject: str
    thresholds_n: tuple[float, ...]
    """At each frequency; above the cap, only an extrapolation that the answers do not contradict."""
    above_cap: tuple[bool, ...]
    slope: float
    """Slope of the psychometric function, in the units of `curve`."""
    criterion: float
    """c in units of d', positive for a tendency to answer 2."""


@dataclass(frozen=True, slots=True)
class PrimaryAnalysis:
    """Estimates of the hierarchical psychometric model."""

    family: Family
    trials: int
    """Number of answers of all persons."""
    frequencies_hz: tuple[float, ...]
    """Those with answers, in ascending order."""
    confidence: float
    """Confidence level of all intervals, 0 to 1."""
    medians: tuple[MedianThreshold, ...]
    overall: RepeatedMeasures
    """Analysis of variance over the pseudo-thresholds in dB."""
    contrasts: tuple[Contrast, ...]
    """Each frequency against the lowest, where that can be tested."""
    limit: DirectionLimit
    persons: tuple[PersonEstimate, ...]
    """Estimates of each person, in the order of `Answers.subjects`."""
    runs: tuple[LikelihoodThreshold, ...]
    """Likelihood of each person's threshold at each frequency, by the answers there alone."""
    person_sd_db: float
    """Standard deviation of thresholds between persons, common to all frequencies."""
    frequency_sd_db: float
    """Standard deviation of the interaction person x frequency."""
    slope: float
    """Median slope of the population, in the units of `curve`."""
    slope_log_sd: float
    """Standard deviation of the natural logarithm of the slope between persons."""
    criterion_sd: float
    """Standard deviation of the criterion between persons, in units of d'."""
    lapse: float
    """Lapse rate common to all persons."""
    goodness: GoodnessOfFit
    """Observed against predicted shares of right answers."""
    converged: bool
    """Whether both fits converged: that of all answers, and that of the analysis of variance where it leaves out
    persons."""
    missing_hz: tuple[float, ...] = ()
    """Frequencies of the protocol without any answer, which the model leaves out."""
    declared_contrast: Contrast | None = None
    """Contrast of the two frequencies that the protocol declares; None without a declaration, or where it cannot be
    tested."""
    far_above_hz: tuple[float, ...] = ()
    """Frequencies whose medians lie more than `FAR_ABOVE_DB` above the cap; there is no contrast between two of
    them."""


def compute_primary_analysis(
    answers: Answers | None,
    cap_n: float,
    family: Family = Family.WEIBULL,
    confidence: float = CONFIDENCE,
    declared_hz: Sequence[float] = (),
) -> PrimaryAnalysis | None:
    """Fit the hierarchical model to all answers; None with fewer than two persons or two frequencies with answers.
    cap_n: cap, N. declared_hz: two frequencies of the declared contrast, first minus second, or empty."""
    if answers is None or answers.persons < 2:
        return None
    requested_hz, answers = answers.frequencies_hz, drop_unanswered_frequencies(answers)
    if len(answers.frequencies_hz) < 2:
        return None
    fit = fit_hierarchy(answers, family)
    cap_db, frequencies_hz = to_db(cap_n), answers.frequencies_hz
    parameters, k, standard_deviations = fit.parameters, fit.layout.k, np.exp(fit.parameters[fit.layout.log_sds])
    persons = estimate_persons(answers.subjects, np.hstack([fit.latent[:, :-2], fit.shared_means]), cap_db)
    medians, comparison = (
        estimate_medians(fit, cap_db, confidence),
        _compare_frequencies(fit, cap_db, confidence, declared_hz),
    )
    bound_above_hz = [m.frequency_hz for m in medians if m.above_cap and m.lower_db is not None and m.lower_db > cap_db]
    return PrimaryAnalysis(
        family=family, trials=answers.trials,
        frequencies_hz=frequencies_hz, confidence=confidence,
        medians=medians,
        overall=comparison.overall,
        contrasts=comparison.contrasts,
        limit=estimate_direction_limit(frequencies_hz, compute_pseudo_thresholds(fit), cap_db, confidence,
                              answers.has_enough_answers, bound_above_hz),
        persons=persons,
        runs=compute_likelihood_thresholds(answers, _make_nuisances(fit, persons), cap_db, family, confidence),
        person_sd_db=float(standard_deviations[0]), frequency_sd_db=float(standard_deviations[1]),
        slope=float(np.exp(parameters[k + 2])),
        slope_log_sd=float(standard_deviations[2]), criterion_sd=float(standard_deviations[3]),
        lapse=fit.lapse, goodness=compute_goodness_of_fit(fit),
        converged=fit.converged and comparison.converged,
        missing_hz=tuple(frequency_hz for frequency_hz in requested_hz if frequency_hz not in frequencies_hz),
        declared_contrast=comparison.declared,
        far_above_hz=comparison.far_above_hz,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _FrequencyComparison:
    """Differences between frequencies, as in `PrimaryAnalysis`."""

    overall: RepeatedMeasures
    contrasts: tuple[Contrast, ...]
    declared: Contrast | None
    far_above_hz: tuple[float, ...]
    converged: bool
    """Whether the fit of the analysis of variance converged."""


def _compare_frequencies(
    fit: HierarchicalFit, cap_db: float, confidence: float, declared_hz: Sequence[float]
) -> _FrequencyComparison:
    """Compare the frequencies by pseudo-thresholds, without differences between two medians far above the cap."""
    frequencies_hz, has_enough_answers, pseudo_thresholds_db = (
        fit.answers.frequencies_hz,
        fit.answers.has_enough_answers,
        compute_pseudo_thresholds(fit),
    )
    far_above_hz = _find_far_above_hz(fit, cap_db)
    is_far_above_cap = np.isin(frequencies_hz, far_above_hz)
    # Contrasts are against the first frequency: if it is far above the cap, others far above it have no contrast.
    determined = ~(is_far_above_cap & is_far_above_cap[0]) | (np.arange(len(is_far_above_cap)) == 0)
    overall, converged = _test_frequency_effect(fit.answers, pseudo_thresholds_db, fit.family, is_far_above_cap)
    return _FrequencyComparison(
        overall=overall,
        contrasts=compute_contrasts(frequencies_hz, pseudo_thresholds_db, confidence, has_enough_answers & determined),
        declared=compare_pair(fit, declared_hz, cap_db, confidence),
        far_above_hz=far_above_hz,
        converged=converged,
    )


def compare_pair(fit: HierarchicalFit, pair_hz: Sequence[float], cap_db: float, confidence: float) -> Contrast | None:
    """Compute the contrast of two frequencies by pseudo-thresholds, first minus second; None where both medians are far
    above the cap (`FAR_ABOVE_DB`), and where `compute_pair_contrast` gives none. cap_db: cap in dB re 1 N."""
    if set(pair_hz) <= set(_find_far_above_hz(fit, cap_db)):
        return None
    answers = fit.answers
    return compute_pair_contrast(
        answers.frequencies_hz, compute_pseudo_thresholds(fit), pair_hz, confidence, answers.has_enough_answers
    )


def _find_far_above_hz(fit: HierarchicalFit, cap_db: float) -> tuple[float, ...]:
    """Find the frequencies whose medians lie more than `FAR_ABOVE_DB` above the cap."""
    is_far_above_cap = fit.means_db > cap_db + FAR_ABOVE_DB
    return tuple(hz for hz, is_above in zip(fit.answers.frequencies_hz, is_far_above_cap, strict=True) if is_above)


def _test_frequency_effect(
    answers: Answers, pseudo_thresholds_db: FloatArray, family: Family, is_far_above_cap: NDArray[np.bool_]
) -> tuple[RepeatedMeasures, bool]:
    """Test the effect of frequency by a repeated-measures analysis of variance of the pseudo-thresholds (n, k); returns
    it, and whether the fit of its pseudo-thresholds converged. is_far_above_cap: (k,), of the medians.

    With two medians or more far above the cap the result is empty, because their unknown difference would be tested,
    too. Persons without enough answers at some frequency are left out, because their pseudo-threshold there carries no
    information; the model is then fitted to the other persons alone."""
    if is_far_above_cap.sum() > 1:
        empty = analyse_repeated_measures((), ())
        return replace(
            empty, participants=answers.persons, conditions=len(is_far_above_cap), notes=(FAR_ABOVE_NOTE,)
        ), True
    is_complete: NDArray[np.bool_] = np.asarray(answers.has_enough_answers.all(axis=1))
    complete_db, converged = np.full(pseudo_thresholds_db.shape, np.nan), True
    if is_complete.all():
        complete_db = pseudo_thresholds_db
    elif is_complete.sum() > 1:
        fit = fit_hierarchy(select_persons(answers, is_complete), family)
        complete_db[is_complete], converged = compute_pseudo_thresholds(fit), fit.converged
    return analyse_repeated_measures(answers.subjects, complete_db.tolist(), ROUNDING_DB), converged


def select_persons(answers: Answers, is_selected: NDArray[np.bool_]) -> Answers:
    """Select the answers of a subset of the persons. is_selected: (persons,)."""
    k, is_selected_cell = len(answers.frequencies_hz), is_selected[answers.person]
    subjects = tuple(subject for subject, is_kept in zip(answers.subjects, is_selected, strict=True) if is_kept)
    new_person_index = np.cumsum(is_selected) - 1
    return Answers(
        subjects=subjects,
        frequencies_hz=answers.frequencies_hz,
        run=(new_person_index[answers.person] * k + answers.run % k)[is_selected_cell],
        level_db=answers.level_db[is_selected_cell],
        side=answers.side[is_selected_cell],
        right=answers.right[is_selected_cell],
        wrong=answers.wrong[is_selected_cell],
    )


def _make_nuisances(fit: HierarchicalFit, persons: Sequence[PersonEstimate]) -> list[Nuisance]:
    """Make the distributions of slope and criterion of each person, with the lapse rate, from the model of all
    answers."""
    return [
        Nuisance(person.slope, person.criterion, (fit.lapse,), *map(float, errors))
        for person, errors in zip(persons, fit.shared_errors, strict=True)
    ]


def drop_unanswered_frequencies(answers: Answers) -> Answers:
    """Drop the frequencies that have no answer, because a mean without data has no estimate."""
    k = len(answers.frequencies_hz)
    answered_indices, new_frequency_index = np.unique(answers.run % k, return_inverse=True)
    frequencies_hz = tuple(answers.frequencies_hz[frequency_index] for frequency_index in answered_indices)
    return replace(
        answers, frequencies_hz=frequencies_hz, run=answers.run // k * len(answered_indices) + new_frequency_index
    )


def estimate_persons(subjects: Sequence[str], latent: FloatArray, cap_db: float) -> tuple[PersonEstimate, ...]:
    """Convert latent parameters to thresholds, slope and criterion of each person. latent: (n, k + 2): thresholds in dB
    re 1 N, natural logarithm of the slope, and criterion. The primary analysis gives posterior modes of the thresholds,
    and posterior means of slope and criterion with the thresholds integrated out."""
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
