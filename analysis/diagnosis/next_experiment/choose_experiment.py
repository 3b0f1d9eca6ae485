"""Optimal experiment to discriminate two rivals: where they differ most after the rival was re-tuned.

Hunter and Reiner (1965), with the information of the existing recordings as the prior of the rival's parameters. A
difference that re-tuning of the rival removes within its tolerance does not count.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.recorded_conditions import add_mass
from analysis.diagnosis.document import NextExperiment
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import MOVED, Fitted
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.next_experiment.experiment_menu import Experiment
from analysis.diagnosis.settings import TELLING_GAIN
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

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
    experiment: Experiment
    gain: float
    """Expected log likelihood ratio in favour of the true effect."""


def predict_gains(
    bench: Bench, named: Fitted, rival: Fitted, known: FloatArray, menu: Sequence[Experiment]
) -> tuple[PredictedGain, ...]:
    """The experiments with their gains, the largest gain per cost first, insufficient ones last. known: (t + numbers,
    t + numbers), information matrix of the rival's numbers from what has been recorded, calibration included."""
    found = [PredictedGain(experiment, _gain(bench, named, rival, known, experiment)) for experiment in menu]
    return tuple(
        sorted(found, key=lambda foreseen: (foreseen.gain < TELLING_GAIN, -foreseen.gain / foreseen.experiment.minutes))
    )


def as_document(best: PredictedGain, names: tuple[str, str]) -> NextExperiment | None:
    """The proposed experiment for the document; None where even the best recording would not tell the rivals apart."""
    if best.gain < TELLING_GAIN:
        return None
    text = "; the recording's meta must say the weight (added_mass_kg, or added_inertia_kg_m2)"
    return NextExperiment(
        command=f"record {best.experiment.words}",
        splits=names,
        why=f"there the two differ by more than the noise and the tolerances can hide: the right one would win by "
        f"{best.gain:.3g} in log likelihood{text if best.experiment.added else ''}",
    )


def _gain(bench: Bench, named: Fitted, rival: Fitted, known: FloatArray, experiment: Experiment) -> float:
    base = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment)
    differs = _simulate(bench, named.deviations, named.hypothesis, named.hypothesis.point, experiment) - base
    columns = []
    for number in range(len(rival.deviations)):
        there = rival.deviations.copy()
        there[number] += MOVED
        columns.append((_simulate(bench, there, rival.hypothesis, rival.hypothesis.point, experiment) - base) / MOVED)
    for number, of in enumerate(rival.hypothesis.numbers):
        point = rival.hypothesis.point.copy()
        point[number] += of.move
        columns.append((_simulate(bench, rival.deviations, rival.hypothesis, point, experiment) - base) / of.move)
    return _squares_after_retuning(bench, rival, known, (experiment, differs, np.array(columns))) / 2


def _squares_after_retuning(
    bench: Bench, rival: Fitted, known: FloatArray, seen: tuple[Experiment, FloatArray, FloatArray]
) -> float:
    """Sum of squares that remains after the rival is re-tuned, by Gauss-Newton steps. seen: the experiment, the
    difference to be tuned away, and the sensitivities to the rival's numbers."""
    experiment, differs, moves = seen
    tuned, t = np.zeros(len(known)), len(rival.deviations)
    wanted = _simulate(bench, rival.deviations, rival.hypothesis, rival.hypothesis.point, experiment) + differs
    whole, least, rest = float(differs @ differs), np.inf, differs
    pull = moves @ differs
    straight = whole - float(pull @ np.linalg.lstsq(moves @ moves.T + known, pull, rcond=None)[0])
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
        played = simulate_mechanism(
            model, experiment.commands, bench.sample_rate_hz, hypothesis.placed_effects(point), bench.hold
        )
        signals = np.hstack([played.response, played.position])[:, : len(bench.noise)]
        return np.asarray((signals / bench.noise).ravel())
