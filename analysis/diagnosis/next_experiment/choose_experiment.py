"""Choose the recordings that best discriminate the named effect from its rivals (optimal experiment design).

Method of Hunter and Reiner (Technometrics 7:307, 1965): the experiment with the largest difference between the
predictions of both models after the rival's parameters are re-tuned. The information of the existing recordings is the
prior of these parameters.

Several recordings: with differences r_i of the predictions for n recordings, sensitivities X_i and prior information K,

    min over d of sum_i |r_i - X_i d|^2 + d' K d  >=  sum_i (min over d of |r_i - X_i d|^2 + d' (K / n) d),

so that the sum of gains computed with the n-th part of the prior is a lower bound of their joint gain.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.recorded_conditions import add_mass
from analysis.diagnosis.document import NextExperiment
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import DIFFERENCE_STEP, Fitted
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.limits import DISCRIMINATING_GAIN
from analysis.diagnosis.next_experiment.experiment_menu import Experiment
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

MOST_RECORDINGS = 3
"""Largest number of recordings that are proposed together. Chosen."""
RETUNING_STEPS = 3
"""Largest number of Gauss-Newton steps of the rival's re-tuning. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """Simulated test bench: model, sampling and noise with which experiments are simulated."""

    tuning: Tuning
    sample_rate_hz: float
    hold: Hold
    noise: FloatArray
    """(c,): rms per channel, response then position."""


@dataclass(frozen=True, slots=True, eq=False)
class PredictedGain:
    """Expected evidence of one experiment for the named effect against a rival."""

    experiment: Experiment
    gain: float
    """Expected log-likelihood ratio in favour of the named effect; 0 where a simulation diverged."""
    shared: float = 0.0
    """The gain with the prior information shared by `MOST_RECORDINGS` recordings, at most `gain`; such gains add up to
    a lower bound of the joint gain of several recordings (module docstring)."""


def predict_gains(
    bench: Bench, named_fit: Fitted, rival: Fitted, information: FloatArray, menu: Sequence[Experiment]
) -> tuple[PredictedGain, ...]:
    """Predict the gain of each experiment, in the menu's order. information: (d, d), information matrix of the rival's
    d parameters, the re-tuned ones first, from the existing recordings and the calibration."""
    return tuple(
        PredictedGain(experiment, *_compute_gains(bench, named_fit, rival, information, experiment))
        for experiment in menu
    )


@dataclass(frozen=True, slots=True)
class ExperimentSet:
    """Experiments proposed together, and the rivals that they discriminate; empty where no experiment discriminates."""

    experiments: tuple[Experiment, ...]
    discriminated: tuple[int, ...]
    """Indices of the rivals that they discriminate from the named effect."""
    gain: float
    """Smallest expected log-likelihood ratio over these rivals, of several recordings its lower bound; 0 for an empty
    set."""


def choose_experiments(predicted: Sequence[Sequence[PredictedGain]]) -> ExperimentSet:
    """Choose recordings that discriminate the rivals of one effect (gain of at least `DISCRIMINATING_GAIN`). If single
    recordings discriminate all rivals, that with the largest gain per minute is chosen; else a greedy set cover, in
    which each next recording reduces the missing gain most per minute. Rivals that no set discriminates are left out.
    predicted: per rival, the gains of one menu, in its order."""
    single_gains, shared_gains = (
        np.array(
            [[float(getattr(prediction, name)) for prediction in rival_gains] for rival_gains in predicted]
        ).reshape(len(predicted), -1)
        for name in ("gain", "shared")
    )
    menu = [prediction.experiment for prediction in predicted[0]] if len(predicted) else []
    duration_min = np.array([experiment.minutes for experiment in menu])
    largest_gain_by_rival = np.maximum(
        single_gains.max(axis=1, initial=0.0), np.sort(shared_gains, axis=1)[:, -MOST_RECORDINGS:].sum(axis=1)
    )
    rivals = [
        int(index)
        for index in np.argsort(-largest_gain_by_rival, kind="stable")
        if largest_gain_by_rival[index] >= DISCRIMINATING_GAIN
    ]
    # Where no set discriminates all remaining rivals, the one with the smallest gain is removed.
    while rivals:
        chosen = _choose_single(single_gains[rivals], duration_min) or _choose_cover(shared_gains[rivals], duration_min)
        if chosen:
            discriminated = tuple(sorted(rivals))
            gain = (
                single_gains[rivals][:, chosen].min()
                if len(chosen) == 1
                else shared_gains[rivals][:, chosen].sum(axis=1).min()
            )
            return ExperimentSet(tuple(menu[index] for index in chosen), discriminated, float(gain))
        rivals.pop()
    return ExperimentSet((), (), 0.0)


def _choose_single(gains: FloatArray, duration_min: FloatArray) -> list[int]:
    """Choose the index of the recording that alone discriminates all rivals, with the largest gain per minute; empty
    where none does. gains: (rivals, menu); duration_min: (menu,), minutes."""
    smallest_gain = gains.min(axis=0)
    if not (smallest_gain >= DISCRIMINATING_GAIN).any():
        return []
    return [int(np.argmax(np.where(smallest_gain >= DISCRIMINATING_GAIN, smallest_gain / duration_min, -np.inf)))]


def _choose_cover(gains: FloatArray, duration_min: FloatArray) -> list[int]:
    """Choose the indices of at most `MOST_RECORDINGS` recordings that together discriminate all rivals; the first
    chosen one that proves redundant is removed. Empty where the greedy search finds none. gains: (rivals, menu);
    duration_min: (menu,), minutes."""
    chosen: list[int] = []
    while (deficit := np.maximum(DISCRIMINATING_GAIN - gains[:, chosen].sum(axis=1), 0.0)).any():
        if len(chosen) == min(MOST_RECORDINGS, len(duration_min)):
            return []
        added_gain = np.minimum(gains, deficit[:, None]).sum(axis=0) / duration_min
        added_gain[chosen] = -np.inf
        chosen.append(int(np.argmax(added_gain)))
    redundant_indices = (
        tested_index
        for tested_index in chosen
        if (
            gains[:, [kept_index for kept_index in chosen if kept_index != tested_index]].sum(axis=1)
            >= DISCRIMINATING_GAIN
        ).all()
    )
    redundant_index = next(redundant_indices, None)
    return [index for index in chosen if index != redundant_index]


def make_document_entry(experiment_set: ExperimentSet, effect_names: Sequence[str]) -> NextExperiment | None:
    """Make the entry of the diagnosis document on the proposed recordings; None for an empty set. effect_names: name of
    the named effect, then of each rival."""
    if not experiment_set.experiments:
        return None
    has_added_mass = any(experiment.added for experiment in experiment_set.experiments)
    weight_remark = (
        "; the recording's meta must state the weight (added_mass_kg, or added_inertia_kg_m2)" if has_added_mass else ""
    )
    first_command, *later_commands = (experiment.words for experiment in experiment_set.experiments)
    place = "in these recordings together" if later_commands else "in this recording"
    return NextExperiment(
        command="; then ".join([f"record {first_command}", *later_commands]),
        splits=(
            effect_names[0],
            *dict.fromkeys(effect_names[1 + rival_index] for rival_index in experiment_set.discriminated),
        ),
        why=f"{place} their predictions differ by more than noise and tolerances can explain: the log likelihood of "
        f"the true effect would exceed that of the others by at least {experiment_set.gain:.3g}{weight_remark}",
    )


def _compute_gains(
    bench: Bench, named_fit: Fitted, rival: Fitted, information: FloatArray, experiment: Experiment
) -> tuple[float, float]:
    """Compute `gain` and `shared` of `PredictedGain` for one experiment; 0 where a simulation diverged. A
    log-likelihood ratio is half a difference of squares in units of the noise."""
    rival_signals = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment)
    difference = (
        _simulate(bench, named_fit.deviations, named_fit.hypothesis, named_fit.hypothesis.point, experiment)
        - rival_signals
    )
    columns = []
    for index in range(len(rival.deviations)):
        columns.append(_compute_deviation_column(bench, rival, index, experiment, rival_signals))
    for index, free_parameter in enumerate(rival.hypothesis.parameters):
        point = rival.hypothesis.point.copy()
        point[index] += free_parameter.difference_step
        columns.append(
            (_simulate(bench, rival.deviations, rival.hypothesis, point, experiment) - rival_signals)
            / free_parameter.difference_step
        )
    sensitivities = np.array(columns)
    if not (np.isfinite(difference).all() and np.isfinite(sensitivities).all()):
        return 0.0, 0.0
    single_gain, shared_gain = (
        _retune_rival(bench, rival, prior_information, (experiment, difference, sensitivities)) / 2
        for prior_information in (information, information / MOST_RECORDINGS)
    )
    return single_gain, min(shared_gain, single_gain)


def _compute_deviation_column(
    bench: Bench, rival: Fitted, index: int, experiment: Experiment, rival_signals: FloatArray
) -> FloatArray:
    """Compute (n c,): change of the rival's prediction by one standard deviation of a parameter of the model, by its
    index; backwards where the model is not valid with the step forwards, NaN where neither is. rival_signals: the
    prediction."""
    for step in (DIFFERENCE_STEP, -DIFFERENCE_STEP):
        displaced_deviations = rival.deviations.copy()
        displaced_deviations[index] += step
        with suppress(MechanicalModelError, np.linalg.LinAlgError):
            signals = _simulate(bench, displaced_deviations, rival.hypothesis, rival.hypothesis.point, experiment)
            return np.asarray((signals - rival_signals) / step)
    return np.full_like(rival_signals, np.nan)


def _retune_rival(
    bench: Bench, rival: Fitted, information: FloatArray, prediction: tuple[Experiment, FloatArray, FloatArray]
) -> float:
    """Re-tune the rival by Gauss-Newton steps, and return the sum of the remaining squared differences and of the prior
    penalty; that of the linearised model where the steps do not reduce it. prediction: the experiment, the difference
    of the predictions (n c,) in units of the noise, and the sensitivities (d, n c) to the rival's parameters."""
    experiment, difference, sensitivities = prediction
    parameter_change, deviation_count = np.zeros(len(information)), len(rival.deviations)
    target = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment) + difference
    initial_squares, smallest_squares, residual = float(difference @ difference), np.inf, difference
    projected_difference = sensitivities @ difference
    linearised_squares = initial_squares - float(
        projected_difference
        @ np.linalg.lstsq(sensitivities @ sensitivities.T + information, projected_difference, rcond=None)[0]
    )
    for _ in range(RETUNING_STEPS):
        step = np.linalg.lstsq(
            sensitivities @ sensitivities.T + information,
            sensitivities @ residual - information @ parameter_change,
            rcond=None,
        )[0]
        parameter_change = parameter_change + step
        try:
            retuned_signals = _simulate(
                bench,
                rival.deviations + parameter_change[:deviation_count],
                rival.hypothesis,
                rival.hypothesis.point + parameter_change[deviation_count:],
                experiment,
            )
        except (MechanicalModelError, np.linalg.LinAlgError):
            break
        residual = target - retuned_signals
        with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
            penalised_squares = float(residual @ residual + parameter_change @ information @ parameter_change)
        if not penalised_squares < smallest_squares:
            break
        smallest_squares = penalised_squares
    return smallest_squares if smallest_squares < initial_squares else max(linearised_squares, 0.0)


def _simulate(
    bench: Bench, deviations: FloatArray, hypothesis: Hypothesis, point: FloatArray, experiment: Experiment
) -> FloatArray:
    """Simulate response and position of an experiment, flattened to (n c,), in units of the noise."""
    model: MechanicalModel = bench.tuning.tune(deviations)
    model = add_mass(model, experiment.added) if experiment.added else model
    with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
        simulation = simulate_mechanism(
            model, experiment.commands, bench.sample_rate_hz, hypothesis.list_placed_effects(point), bench.hold
        )
        signals = np.hstack([simulation.response, simulation.position])[:, : len(bench.noise)]
        return np.asarray((signals / bench.noise).ravel())
