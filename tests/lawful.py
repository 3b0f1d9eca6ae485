"""A small device with a law that its model lacks, recorded at three levels, then louder and in a sweep."""

import numpy as np

from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.search.explain import Explanation, retune_alone
from analysis.diagnosis.search.search_context import SearchContext
from equalizer.effects.discovered_law import Channels, get_law_values, make_law_effect
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.laws.law import ActsOn, Law
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from tests.diagnosed import NOISE, PERIOD, RATE_HZ, device

PLAN = (("multisine", 0.7, "fit"), ("multisine", 1.5, "fit"), ("multisine", 3.0, "fit"), ("sweep", 3.6, "test"))
LOOKS = 2


def law(expression: str, *numbers: float, acts_on: ActsOn = "force") -> Law:
    return Law(expression, numbers, (), acts_on, "x")


def recorded(laws: tuple[Law, ...], seed: int, noise: float = 1.0, plan=PLAN) -> Recording:
    """On one axis."""
    rng = np.random.default_rng(seed)
    blocks, segments, at = [], [], 0
    for kind, level, role in plan:
        wave = np.tile(_multisine(rng), LOOKS) if kind == "multisine" else _sweep()
        blocks += [level * wave[:, None], np.zeros((300, 1))]
        period = PERIOD if kind == "multisine" else 0
        segments.append(Segment(at, at + len(wave), kind, level, period, role))
        at += len(wave) + 300
    command = np.vstack(blocks)
    effects = [
        PlacedEffect(make_law_effect(each, Channels(("fx",), ("ax",))), (0,), get_law_values(each)) for each in laws
    ]
    model = device(1)
    played = simulate_mechanism(model, command, RATE_HZ, effects)

    def signal(samples: FloatArray, quantity: str, unit: str, name: str, rms: float = 0.0) -> Signal:
        return Signal(samples + noise * rms * rng.standard_normal(samples.shape), RATE_HZ, quantity, unit, (name,))

    return Recording(
        "small", signal(command, "force", "N", "fx"),
        signal(played.response, "acceleration", "m/s^2", "ax", NOISE[0]),
        signal(played.position, "position", "m", "x", NOISE[1]), segments=tuple(segments),
    )  # fmt: skip


def _multisine(rng: np.random.Generator) -> FloatArray:
    lines = np.arange(1, 120, 2)
    t = np.arange(PERIOD) / RATE_HZ
    turns = rng.uniform(0, 2 * np.pi, (len(lines), 1))
    wave = np.sum(np.cos(2 * np.pi * np.outer(lines, t) + turns) / np.sqrt(lines)[:, None], axis=0)
    return np.asarray(wave / np.abs(wave).max())


def _sweep() -> FloatArray:
    t = np.arange(2500) / RATE_HZ
    rise = np.minimum(t / 0.2, 1.0)
    return np.asarray(rise * rise[::-1] * np.sin(2 * np.pi * (1.0 * t + 5.0 * t**2)))


def arena_of(recording: Recording, model: MechanicalModel | None = None) -> tuple[SearchContext, Explanation]:
    """And what re-tuning alone leaves."""
    given = model or device(1)
    measure = make_measure([recording], given).measure
    tuning = make_tuning(given, recording.command.channels)
    context = SearchContext(measure.shorten(), measure, tuning, map)
    before = evaluate_fit(context.measure, tuning, np.zeros(len(tuning.names)), NO_EFFECTS)
    given_, retuned = (context.with_test_score(context.score_fit(fitted)) for fitted in (before, retune_alone(context)))
    return context, Explanation(given_, retuned, retuned, (), ())
