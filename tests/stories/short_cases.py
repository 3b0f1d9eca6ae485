"""Concealed-physics cases on short recordings: the challenge's benches and devices, driven for a quarter of a minute.

The device is integrated by the challenge, which shares no code with the diagnosis; the model is its bare bench, each
grounded number off by its tolerance.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.evaluation.challenge.bench import Bench, draw_bench
from study.evaluation.challenge.device import Device, record
from study.evaluation.challenge.draw_case import DECOYS, EFFECTS
from study.evaluation.challenge.drive_plan import LEVELS_N, RATE_HZ
from study.evaluation.challenge.nominal_models import draw_calibration, make_model

PERIOD, PERIODS, REST = 1000, 3, 300
LAST_LINE = 200


@dataclass(frozen=True)
class ShortCase:
    recording: Recording
    model: MechanicalModel


def short_case(
    seed: int,
    concealed: Mapping[str, Mapping[str, float]],
    axis: int = 0,
    axes: tuple[int, ...] = (0,),
    played: Callable[[np.ndarray], np.ndarray] = lambda commands: commands,
) -> ShortCase:
    """concealed: values by effect's name. axis: where they sit. axes: those that are driven and read; the others only
    move along. played: what the device is driven with, of what the recording says."""
    random = np.random.default_rng(seed)
    bench = draw_bench(random)
    device = Device(bench)
    for name, values in concealed.items():
        device = (EFFECTS | DECOYS)[name].build(device, axis, values)
    commands, segments = _drive(random, axes)
    response, position = record(device, played(commands), random)
    known, tolerance = draw_calibration(bench, random)
    return ShortCase(_recording(commands, response, position, axes, segments), _model(known, tolerance, axes))


def _drive(random: np.random.Generator, axes: tuple[int, ...]) -> tuple[np.ndarray, tuple[Segment, ...]]:
    """Each axis at three levels, then another wave at the middle one, to test by."""
    blocks, segments, at = [], [], 0
    for role, levels in (("fit", LEVELS_N), ("test", LEVELS_N[1:2])):
        for axis in axes:
            for level in levels:
                block = np.zeros((PERIODS * PERIOD + REST, 3))
                block[: PERIODS * PERIOD, axis] = np.tile(_multisine(random, level), PERIODS)
                segments.append(Segment(at, at + PERIODS * PERIOD, "multisine", level, PERIOD, role))
                blocks.append(block)
                at += len(block)
    return np.vstack(blocks), tuple(segments)


def _multisine(random: np.random.Generator, level: float) -> np.ndarray:
    """One period: odd lines, each fourth of them silent."""
    lines = np.arange(1, LAST_LINE, 2)
    lines = lines[np.arange(len(lines)) % 4 != 2]
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * random.random(len(lines))) / np.sqrt(lines)
    wave = np.fft.irfft(spectrum, PERIOD)
    return level * wave / np.abs(wave).max()


def _recording(commands, response, position, axes, segments) -> Recording:
    names = ["xyz"[axis] for axis in axes]

    def signal(samples, quantity, unit, letter=""):
        return Signal(samples[:, list(axes)], RATE_HZ, quantity, unit, tuple(letter + name for name in names))

    return Recording(
        "short", signal(commands, "force", "N", "f"), signal(response, "acceleration", "m/s^2", "a"),
        signal(position, "position", "m"), segments=segments,
    )  # fmt: skip


def _model(known: Bench, tolerance, axes) -> MechanicalModel:
    whole = make_model("short", known, tolerance)
    return MechanicalModel(
        "short", "acceleration", whole.mass, whole.damping, whole.stiffness,
        whole.input[:, list(axes)], whole.output[list(axes)], whole.sensor, tolerance=tolerance,
    )  # fmt: skip
