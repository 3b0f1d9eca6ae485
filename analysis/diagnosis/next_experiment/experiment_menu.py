"""Menu of experiments that a laboratory could record next to discriminate rival effects, as commands to simulate.

Sweeps at several levels, slow sinusoids, a longer sweep, pushes and releases, and a sweep with added mass:
`propose_experiment` predicts by simulation how well each discriminates the rivals. Nothing exceeds the level already
recorded. Commands are in the model's unit (N, N m, or that of the current).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.excitation import apply_fades, log_sweep, sine
from equalizer.signals.signal import FloatArray

SLOWEST_HZ, SLOWEST_SHARE = 1.0, 0.1
"""Lowest frequency of sweeps: in Hz, or as a share of their usual upper end; the lower of the two."""
CYCLES, LONG_FACTOR = 8.0, 5.0
"""Length of an experiment in cycles of the sweep's lowest frequency, and the factor on it for the long sweep."""
USUAL_HZ, USUAL_SHARE, FASTEST_SHARE = 240.0, 0.24, 0.45
"""Upper end of sweeps: in Hz, or as a share of the sample rate, the lower of the two; and that of wide sweeps, as a
share of the sample rate, below half of it."""
ADDED_SHARE = 0.12
"""Known mass (or inertia) to attach, relative to the mean mass at the driven axes."""
RELEASES = 4
"""Releases of the deflected handle in a free-decay experiment, to either side in turn."""
_FADE = 1 / 16
"""Length of the fade at either end, over the usual length of an experiment."""


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """A recording that could be made next: its commands, its description for the user, and its cost."""

    words: str
    """What to record; ends the sentence "record …"."""
    commands: FloatArray
    """(n, m), in the unit of the model's commands"""
    kind: Literal["sweep", "slow", "step"]
    """Kind of the recording's segment."""
    added: float = 0.0
    """Mass (kg, or kg m^2 of a rotational model) to attach beforehand; 0 = none."""
    minutes: float = 1.0
    """Assumed laboratory time (min): the cost by which `choose_experiment` divides the gain."""


def experiment_menu(model: MechanicalModel, sample_rate_hz: float, axis: int, level: float) -> tuple[Experiment, ...]:
    """Experiments that can be proposed. axis: driven axis on which the rivals act. level: largest command recorded on
    it, above 0; no experiment exceeds it."""
    usual_hz = min(USUAL_HZ, USUAL_SHARE * sample_rate_hz)
    fastest_hz = FASTEST_SHARE * sample_rate_hz
    slowest_hz = min(SLOWEST_HZ, SLOWEST_SHARE * usual_hz)
    length_s = CYCLES / slowest_hz
    fade = int(_FADE * length_s * sample_rate_hz)
    slow_hz = 4.0 / length_s
    added = ADDED_SHARE * _find_grounded_mass(model)

    def drive(wave: FloatArray) -> FloatArray:
        return np.outer(apply_fades(wave, fade, fade), np.arange(model.inputs) == axis)

    def chirp(peak: float, to_hz: float = usual_hz, times: float = 1.0) -> FloatArray:
        return drive(log_sweep(slowest_hz, to_hz, peak, int(times * length_s * sample_rate_hz), sample_rate_hz))

    def tone(peak: float) -> FloatArray:
        return drive(sine(slow_hz, peak, int(length_s * sample_rate_hz), sample_rate_hz))

    sweep, wide = (f"a sweep from {slowest_hz:.3g} to {end:.3g} Hz" for end in (usual_hz, fastest_hz))
    levels = {1: "the highest level so far", 4: "a quarter of the highest level", 20: "a twentieth of it"}
    return (
        *(Experiment(f"{sweep} at {level / n:.3g}, {words}", chirp(level / n), "sweep") for n, words in levels.items()),
        Experiment(f"{wide} at {level:.3g}", chirp(level, fastest_hz), "sweep"),
        Experiment(f"a slow sinusoid of {slow_hz:.3g} Hz at {level:.3g}", tone(level), "slow"),
        Experiment(
            f"a slow sinusoid of {slow_hz:.3g} Hz at {level / 10:.3g}, so small that the device hardly moves",
            tone(level / 10),
            "slow",
        ),
        Experiment(
            f"{wide} at {level:.3g} that lasts {LONG_FACTOR * length_s:.3g} s",
            chirp(level, fastest_hz, LONG_FACTOR),
            "sweep",
            minutes=1.5,
        ),
        *(_pushes(sweep, level, chirp(level / 2), fade) if _is_stiff(model, axis, slowest_hz) else ()),
        Experiment(
            f"{sweep} at {level:.3g} with {_weight_words(model, added)}", chirp(level), "sweep", added, minutes=3.0
        ),
    )


def _is_stiff(model: MechanicalModel, axis: int, slowest_hz: float) -> bool:
    """Whether a constant force deflects the axis at most twice as far as a sinusoid of the sweep's lowest frequency:
    an axis without stiffness, or with little, would be driven away. From the static compliance b' K^-1 b and the
    dynamic one b' (M s^2 + D s + K)^-1 b, with b the axis."""
    axes = driven_axes(model)[:, axis]
    s = 2j * np.pi * slowest_hz
    try:
        static_compliance = np.linalg.solve(model.stiffness, axes)
        dynamic_compliance = np.linalg.solve(model.mass * s**2 + model.damping * s + model.stiffness, axes)
    except np.linalg.LinAlgError:
        return False
    return bool(0 < axes @ static_compliance <= 2 * abs(axes @ dynamic_compliance))


def _pushes(sweep: str, level: float, half: FloatArray, fade: int) -> tuple[Experiment, Experiment]:
    """Experiments with a static force: a sweep about another position, and releases from deflection. sweep: its
    description. half: (n, m), the sweep at half the level. fade: samples."""
    axis_mask = (np.abs(half).max(axis=0) > 0).astype(np.float64)
    samples = len(half)
    constant_force = apply_fades(np.full(samples, level / 2), fade, fade)
    return (
        Experiment(
            f"{sweep} at {level / 2:.3g} in addition to a constant force of the same size, which moves the device to "
            "another place",
            half + np.outer(constant_force, axis_mask),
            "sweep",
        ),
        Experiment(
            f"{RELEASES} releases: a force that grows slowly to {level:.3g}, in alternating directions, and ends "
            "abruptly",
            np.outer(_releases(level, samples), axis_mask),
            "step",
        ),
    )


def _releases(level: float, samples: int) -> FloatArray:
    """(n,): ramps up to the level, in either direction in turn, each followed by zero force for as long: the device
    then decays freely."""
    ramp_samples = samples // (2 * RELEASES)
    ramp = np.append(np.linspace(0.0, level, ramp_samples), np.zeros(ramp_samples))
    signs = [1.0 if number % 2 == 0 else -1.0 for number in range(RELEASES)]
    return np.concatenate([sign * ramp for sign in signs])


def _find_grounded_mass(model: MechanicalModel) -> float:
    """Mean mass at the driven axes, in kg or kg m^2."""
    axes = driven_axes(model)
    return float(np.diagonal(axes.T @ model.mass @ axes).mean())


def _weight_words(model: MechanicalModel, added: float) -> str:
    if model.rotational:
        return f"a known inertia of {added:.2g} kg m^2 on the lever"
    return f"{1e3 * added:.0f} g strapped to the handle"
