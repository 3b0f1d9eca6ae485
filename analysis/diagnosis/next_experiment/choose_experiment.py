"""Optimal experiments to discriminate rivals: where they differ most after the rival was re-tuned.

Hunter and Reiner (1965), with the information of the existing recordings as the prior of the rival's parameters. A
difference that re-tuning of the rival removes within its tolerance does not count.

Several recordings: with residuals r_i of n recordings, sensitivities X_i and prior information K,

    min over d of sum_i |r_i - X_i d|^2 + d' K d  >=  sum_i (min over d of |r_i - X_i d|^2 + d' (K / n) d),

so that gains which were computed with the n-th part of the prior add up to a lower bound of what they gain together.
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

MOST_TOGETHER = 3
"""Recordings that are proposed at once."""
RETUNED = 3
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
    """The same with a part of the prior information, as one of `MOST_TOGETHER` recordings."""


def predict_gains(
    bench: Bench, named: Fitted, rival: Fitted, known: FloatArray, menu: Sequence[Experiment]
) -> tuple[PredictedGain, ...]:
    """The experiments with their gains, in the menu's order. known: (t + parameters, t + parameters), information
    matrix of the rival's parameters from what has been recorded, calibration included."""
    return tuple(PredictedGain(experiment, *_gains(bench, named, rival, known, experiment)) for experiment in menu)


@dataclass(frozen=True, slots=True)
class ExperimentSet:
    """The experiments to make next and the rivals that they discriminate; empty where none would."""

    experiments: tuple[Experiment, ...]
    discriminated: tuple[int, ...]
    """Which rivals they discriminate from what is named, by their place."""
    gain: float
    """Smallest expected log likelihood ratio, over these rivals."""


def choose_set(predicted: Sequence[Sequence[PredictedGain]]) -> ExperimentSet:
    """The recordings to make for rivals of one effect; empty where none would discriminate. A single one where one
    discriminates all that can be, that with the largest gain per cost; else the one first that adds most, per cost, to
    what is still missing (greedy set cover). predicted: per rival, the gains of one menu, in its order."""
    alone, shared = (
        np.array([[float(getattr(each, name)) for each in of] for of in predicted]).reshape(len(predicted), -1)
        for name in ("gain", "shared")
    )
    menu = [each.experiment for each in predicted[0]] if len(predicted) else []
    cost = np.array([experiment.minutes for experiment in menu])
    most = np.maximum(alone.max(axis=1, initial=0.0), np.sort(shared, axis=1)[:, -MOST_TOGETHER:].sum(axis=1))
    wanted = [int(number) for number in np.argsort(-most, kind="stable") if most[number] >= TELLING_GAIN]
    # Without the hardest rival, where all together are out of reach.
    while wanted:
        chosen = _single(alone[wanted], cost) or _cover(shared[wanted], cost)
        if chosen:
            discriminated = tuple(sorted(wanted))
            gain = alone[wanted][:, chosen].min() if len(chosen) == 1 else shared[wanted][:, chosen].sum(axis=1).min()
            return ExperimentSet(tuple(menu[number] for number in chosen), discriminated, float(gain))
        wanted.pop()
    return ExperimentSet((), (), 0.0)


def _single(gains: FloatArray, cost: FloatArray) -> list[int]:
    """The recording that discriminates every rival by itself, with the largest gain per cost; empty where none does."""
    weakest = gains.min(axis=0)
    if not (weakest >= TELLING_GAIN).any():
        return []
    return [int(np.argmax(np.where(weakest >= TELLING_GAIN, weakest / cost, -np.inf)))]


def _cover(gains: FloatArray, cost: FloatArray) -> list[int]:
    """A few recordings that discriminate every rival together; empty where as many as `MOST_TOGETHER` do not."""
    chosen: list[int] = []
    while (missing := np.maximum(TELLING_GAIN - gains[:, chosen].sum(axis=1), 0.0)).any():
        if len(chosen) == min(MOST_TOGETHER, len(cost)):
            return []
        added = np.minimum(gains, missing[:, None]).sum(axis=0) / cost
        added[chosen] = -np.inf
        chosen.append(int(np.argmax(added)))
    needless = (k for k in chosen if (gains[:, [j for j in chosen if j != k]].sum(axis=1) >= TELLING_GAIN).all())
    dropped = next(needless, None)
    return [number for number in chosen if number != dropped]


def as_document(best: ExperimentSet, names: Sequence[str]) -> NextExperiment | None:
    """The proposed recordings for the document; None where even the best would not tell the rivals apart. names: of
    what is named, then of each rival."""
    if not best.experiments:
        return None
    weighted = any(experiment.added for experiment in best.experiments)
    said = "; the recording's meta must state the weight (added_mass_kg, or added_inertia_kg_m2)" if weighted else ""
    first, *more = (experiment.words for experiment in best.experiments)
    where = "in these recordings together" if more else "there"
    return NextExperiment(
        command="; then ".join([f"record {first}", *more]),
        splits=(names[0], *dict.fromkeys(names[1 + number] for number in best.discriminated)),
        why=f"{where} their predictions differ by more than noise and tolerances can explain: the log likelihood of "
        f"the true effect would exceed that of the others by at least {best.gain:.3g}{said}",
    )


def _gains(
    bench: Bench, named: Fitted, rival: Fitted, known: FloatArray, experiment: Experiment
) -> tuple[float, float]:
    """Gain by itself, and as one of several recordings."""
    base = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment)
    differs = _simulate(bench, named.deviations, named.hypothesis, named.hypothesis.point, experiment) - base
    columns = []
    for number in range(len(rival.deviations)):
        there = rival.deviations.copy()
        there[number] += DIFFERENCE_STEP
        moved = _simulate(bench, there, rival.hypothesis, rival.hypothesis.point, experiment)
        columns.append((moved - base) / DIFFERENCE_STEP)
    for number, of in enumerate(rival.hypothesis.parameters):
        point = rival.hypothesis.point.copy()
        point[number] += of.move
        columns.append((_simulate(bench, rival.deviations, rival.hypothesis, point, experiment) - base) / of.move)
    moves = np.array(columns)
    if not (np.isfinite(differs).all() and np.isfinite(moves).all()):
        return 0.0, 0.0
    alone, shared = (
        _squares_after_retuning(bench, rival, of, (experiment, differs, moves)) / 2
        for of in (known, known / MOST_TOGETHER)
    )
    return alone, min(shared, alone)


def _squares_after_retuning(
    bench: Bench, rival: Fitted, known: FloatArray, seen: tuple[Experiment, FloatArray, FloatArray]
) -> float:
    """Sum of squares that remains after the rival is re-tuned, by Gauss-Newton steps. seen: the experiment, the
    difference to be tuned away, and the sensitivities to the rival's parameters."""
    experiment, differs, moves = seen
    tuned, t = np.zeros(len(known)), len(rival.deviations)
    wanted = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment) + differs
    whole, least, rest = float(differs @ differs), np.inf, differs
    rhs = moves @ differs
    straight = whole - float(rhs @ np.linalg.lstsq(moves @ moves.T + known, rhs, rcond=None)[0])
    for _ in range(RETUNED):
        step = np.linalg.lstsq(moves @ moves.T + known, moves @ rest - known @ tuned, rcond=None)[0]
        tuned = tuned + step
        try:
            there = _simulate(
                bench, rival.deviations + tuned[:t], rival.hypothesis, rival.hypothesis.point + tuned[t:], experiment
            )
        except (MechanicalModelError, np.linalg.LinAlgError):
            break
        rest = wanted - there
        with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
            squares = float(rest @ rest + tuned @ known @ tuned)
        if not squares < least:
            break
        least = squares
    # Where the steps diverge, the linear prediction is used: it promises rather too little.
    return least if least < whole else max(straight, 0.0)


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
