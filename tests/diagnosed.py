"""A diagnosis made from real fits: a small simulated device with dry friction that its model lacks. Compiles."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.document import NextExperiment, Rival
from analysis.diagnosis.result.findings import BlackBox, Findings
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.coulomb_friction import EFFECT as DRY
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits, Tolerance
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

TRIED = ("coulomb_friction", "force_deadband")
RATE_HZ = 1000.0
PERIOD, LOOKS = 1000, 3
LEVELS_N = (0.5, 1.5, 3.0)
FRICTION_N = 0.2
NOISE = (0.05, 4e-6)
"""Rms of acceleration and position."""


def device(axes: int) -> MechanicalModel:
    eye = np.eye(axes)
    couple = 0.01 * (np.ones((axes, axes)) - eye)
    return MechanicalModel(
        "small", "acceleration", 0.25 * eye + couple, 4.0 * eye, 130.0 * eye, eye, eye, SensorLimits(400.0, 0.0),
        tolerance=Tolerance(0.0003, 0.03, 0.8, 0.01),
    )  # fmt: skip


RUBBING = (PlacedEffect(DRY, (0,), {"level": FRICTION_N}),)


def recorded(axes: int, effects=RUBBING, seed: int = 4) -> Recording:
    """Each axis at three levels, then a test at the middle one; friction at the first axis unless told otherwise."""
    rng = np.random.default_rng(seed)
    commands, segments, at = [], [], 0
    plan = [(axis, level, "fit") for axis in range(axes) for level in LEVELS_N]
    plan += [(axis, LEVELS_N[1], "test") for axis in range(axes)]
    for axis, level, role in plan:
        wave = np.zeros((LOOKS * PERIOD + 200, axes))
        wave[: LOOKS * PERIOD, axis] = np.tile(_multisine(rng, level), LOOKS)
        commands.append(wave)
        segments.append(Segment(at, at + LOOKS * PERIOD, "multisine", level, PERIOD, role))
        at += len(wave)
    command = np.vstack(commands)
    played = simulate_mechanism(device(axes), command, RATE_HZ, effects)
    names = "xyz"[:axes]

    def signal(samples, quantity, unit, letter="", noise=0.0):
        read = samples + noise * rng.standard_normal(samples.shape)
        return Signal(read, RATE_HZ, quantity, unit, tuple(letter + name for name in names))

    return Recording(
        "small", signal(command, "force", "N", "f"),
        signal(played.response, "acceleration", "m/s^2", "a", NOISE[0]),
        signal(played.position, "position", "m", "", NOISE[1]), segments=tuple(segments),
    )  # fmt: skip


def _multisine(rng, level):
    lines = np.arange(1, 120, 2)
    lines = lines[np.arange(len(lines)) % 4 != 2]
    t = np.arange(PERIOD) / RATE_HZ
    wave = np.sum(np.cos(2 * np.pi * np.outer(lines, t) + rng.uniform(0, 2 * np.pi, (len(lines), 1))), axis=0)
    return level * wave / np.abs(wave).max()


def diagnosed(recording: Recording, given: MechanicalModel) -> Findings:
    """As the engine finds it among two effects, with what it may not say yet made up: rivals, a black box, a remark
    and a next recording. given: the model that lacks the friction."""
    others = tuple(effect.name for effect in CATALOGUE if effect.name not in TRIED)
    found = diagnose([recording], given, DiagnosisSettings(without=others), map, lambda said, share: None)
    rival = Rival("amplifier_lag", 0.03, False, "it leaves 4.1 times the noise")
    splits = ("coulomb_friction", "stribeck_friction")
    document = replace(
        found.diagnosis,
        effects=tuple(
            replace(effect, share=0.9, probability=0.97, rivals=(rival,)) for effect in found.diagnosis.effects
        ),
        next_experiment=NextExperiment("hapteq record slow.toml", splits, "slow motion"),
    )
    return replace(found, diagnosis=document, black_box=BlackBox("ARX", 12, 0.05, 0.02), remarks=("A remark.",))
