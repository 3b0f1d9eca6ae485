"""Optimal experiments to discriminate rivals: the largest difference of their predictions after the rival's re-tuning.

Method of Hunter and Reiner (Technometrics 7:307, 1965), with the information of the existing recordings as the prior of
the rival's parameters. Called by `propose_experiment`.

Several recordings: with residuals r_i of n recordings, sensitivities X_i and prior information K,

    min over d of sum_i |r_i - X_i d|^2 + d' K d  >=  sum_i (min over d of |r_i - X_i d|^2 + d' (K / n) d),

so that the sum of gains computed with the n-th part of the prior is a lower bound of their joint gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.recorded_conditions import add_mass
from analysis.diagnosis.document import NextExperiment
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import DIFFERENCE_STEP, Fitted
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.next_experiment.experiment_menu import Experiment
from analysis.diagnosis.settings import TELLING_GAIN
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

MOST_RECORDINGS = 3
"""Recordings that are proposed at once."""
RETUNING_STEPS = 3
"""Gauss-Newton steps of the rival's re-tuning."""


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """The device on which experiments are simulated."""

    tuning: Tuning
    sample_rate_hz: float
    hold: Hold
    noise: FloatArray
    """(c,): rms per channel, response then position."""


@dataclass(frozen=True, slots=True, eq=False)
class PredictedGain:
    """Expected discrimination between the named effect and a rival by an experiment."""

    experiment: Experiment
    gain: float
    """Expected log likelihood ratio in favour of the true effect; 0 where a simulation diverged."""
    shared: float = 0.0
    """The same with a part of the prior information, as one of `MOST_RECORDINGS` recordings."""


def predict_gains(
    bench: Bench, named_fit: Fitted, rival: Fitted, information: FloatArray, menu: Sequence[Experiment]
) -> tuple[PredictedGain, ...]:
    """The experiments with their gains, in the menu's order. information: (t + parameters, t + parameters), information
    matrix of the rival's parameters from what has been recorded, calibration included."""
    return tuple(
        PredictedGain(experiment, *_compute_gains(bench, named_fit, rival, information, experiment))
        for experiment in menu
    )


@dataclass(frozen=True, slots=True)
class ExperimentSet:
    """The experiments to make next and the rivals that they discriminate; empty where none would."""

    experiments: tuple[Experiment, ...]
    discriminated: tuple[int, ...]
    """Indices of the rivals that they discriminate from the named effect."""
    gain: float
    """Smallest expected log likelihood ratio, over these rivals."""


def choose_experiments(predicted: Sequence[Sequence[PredictedGain]]) -> ExperimentSet:
    """Choose recordings that discriminate the rivals of one effect; empty where none would. If a single recording
    discriminates all rivals, that with the largest gain per minute; else a greedy set cover: each next recording
    reduces the missing gain most per minute. predicted: per rival, the gains of one menu, in its order."""
    single_gains, shared_gains = (
        np.array(
            [[float(getattr(prediction, name)) for prediction in rival_gains] for rival_gains in predicted]
        ).reshape(len(predicted), -1)
        for name in ("gain", "shared")
    )
    menu = [prediction.experiment for prediction in predicted[0]] if len(predicted) else []
    cost = np.array([experiment.minutes for experiment in menu])
    largest_gains = np.maximum(
        single_gains.max(axis=1, initial=0.0), np.sort(shared_gains, axis=1)[:, -MOST_RECORDINGS:].sum(axis=1)
    )
    rivals = [int(index) for index in np.argsort(-largest_gains, kind="stable") if largest_gains[index] >= TELLING_GAIN]
    # Where no set discriminates all rivals, the rival with the smallest gain is left out.
    while rivals:
        chosen = _choose_single(single_gains[rivals], cost) or _choose_cover(shared_gains[rivals], cost)
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


def _choose_single(gains: FloatArray, cost: FloatArray) -> list[int]:
    """The recording that discriminates every rival by itself, with the largest gain per cost; empty where none does."""
    weakest = gains.min(axis=0)
    if not (weakest >= TELLING_GAIN).any():
        return []
    return [int(np.argmax(np.where(weakest >= TELLING_GAIN, weakest / cost, -np.inf)))]


def _choose_cover(gains: FloatArray, cost: FloatArray) -> list[int]:
    """A few recordings that discriminate every rival together; empty where as many as `MOST_RECORDINGS` do not."""
    chosen: list[int] = []
    while (deficit := np.maximum(TELLING_GAIN - gains[:, chosen].sum(axis=1), 0.0)).any():
        if len(chosen) == min(MOST_RECORDINGS, len(cost)):
            return []
        added_gain = np.minimum(gains, deficit[:, None]).sum(axis=0) / cost
        added_gain[chosen] = -np.inf
        chosen.append(int(np.argmax(added_gain)))
    redundant = (k for k in chosen if (gains[:, [j for j in chosen if j != k]].sum(axis=1) >= TELLING_GAIN).all())
    dropped = next(redundant, None)
    return [number for number in chosen if number != dropped]


def make_document_entry(best: ExperimentSet, names: Sequence[str]) -> NextExperiment | None:
    """The proposed recordings as an entry of the document; None where `best` is empty. names: of the named effect, then
    of each rival."""
    if not best.experiments:
        return None
    has_added_mass = any(experiment.added for experiment in best.experiments)
    weight_remark = (
        "; the recording's meta must state the weight (added_mass_kg, or added_inertia_kg_m2)" if has_added_mass else ""
    )
    first_command, *later_commands = (experiment.words for experiment in best.experiments)
    place = "in these recordings together" if later_commands else "there"
    return NextExperiment(
        command="; then ".join([f"record {first_command}", *later_commands]),
        splits=(names[0], *dict.fromkeys(names[1 + number] for number in best.discriminated)),
        why=f"{place} their predictions differ by more than noise and tolerances can explain: the log likelihood of "
        f"the true effect would exceed that of the others by at least {best.gain:.3g}{weight_remark}",
    )


def _compute_gains(
    bench: Bench, named_fit: Fitted, rival: Fitted, information: FloatArray, experiment: Experiment
) -> tuple[float, float]:
    """Gain of the experiment alone, and with the n-th part of the prior, as one of `MOST_RECORDINGS` recordings."""
    base = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment)
    difference = (
        _simulate(bench, named_fit.deviations, named_fit.hypothesis, named_fit.hypothesis.point, experiment) - base
    )
    columns = []
    for number in range(len(rival.deviations)):
        displaced = rival.deviations.copy()
        displaced[number] += DIFFERENCE_STEP
        displaced_signals = _simulate(bench, displaced, rival.hypothesis, rival.hypothesis.point, experiment)
        columns.append((displaced_signals - base) / DIFFERENCE_STEP)
    for number, free_parameter in enumerate(rival.hypothesis.parameters):
        point = rival.hypothesis.point.copy()
        point[number] += free_parameter.difference_step
        columns.append(
            (_simulate(bench, rival.deviations, rival.hypothesis, point, experiment) - base)
            / free_parameter.difference_step
        )
    sensitivities = np.array(columns)
    if not (np.isfinite(difference).all() and np.isfinite(sensitivities).all()):
        return 0.0, 0.0
    single_gain, shared_gain = (
        _retune_rival(bench, rival, free_parameter, (experiment, difference, sensitivities)) / 2
        for free_parameter in (information, information / MOST_RECORDINGS)
    )
    return single_gain, min(shared_gain, single_gain)


def _retune_rival(
    bench: Bench, rival: Fitted, information: FloatArray, prediction: tuple[Experiment, FloatArray, FloatArray]
) -> float:
    """Sum of squares that remains after the rival is re-tuned by Gauss-Newton steps. prediction: the experiment, the
    difference of the predictions, and the sensitivities to the rival's parameters."""
    experiment, difference, sensitivities = prediction
    tuned, t = np.zeros(len(information)), len(rival.deviations)
    target = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment) + difference
    initial_squares, smallest, remainder = float(difference @ difference), np.inf, difference
    rhs = sensitivities @ difference
    linear_prediction = initial_squares - float(
        rhs @ np.linalg.lstsq(sensitivities @ sensitivities.T + information, rhs, rcond=None)[0]
    )
    for _ in range(RETUNING_STEPS):
        step = np.linalg.lstsq(
            sensitivities @ sensitivities.T + information, sensitivities @ remainder - information @ tuned, rcond=None
        )[0]
        tuned = tuned + step
        try:
            retuned_signals = _simulate(
                bench, rival.deviations + tuned[:t], rival.hypothesis, rival.hypothesis.point + tuned[t:], experiment
            )
        except (MechanicalModelError, np.linalg.LinAlgError):
            break
        remainder = target - retuned_signals
        with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
            squares = float(remainder @ remainder + tuned @ information @ tuned)
        if not squares < smallest:
            break
        smallest = squares
    # Where the steps diverge, the prediction of the linearised model is used, which is rather too small.
    return smallest if smallest < initial_squares else max(linear_prediction, 0.0)


def _simulate(
    bench: Bench, deviations: FloatArray, hypothesis: Hypothesis, point: FloatArray, experiment: Experiment
) -> FloatArray:
    model: MechanicalModel = bench.tuning.tune(deviations)
    model = add_mass(model, experiment.added) if experiment.added else model
    with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
        simulated = simulate_mechanism(
            model, experiment.commands, bench.sample_rate_hz, hypothesis.list_placed_effects(point), bench.hold
        )
        signals = np.hstack([simulated.response, simulated.position])[:, : len(bench.noise)]
        return np.asarray((signals / bench.noise).ravel())
