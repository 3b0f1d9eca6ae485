"""List the experiments that a laboratory could record next to discriminate rival effects, as commands to simulate.

Sweeps at several levels, a wide and a longer sweep, slow sinusoids, for a stiff axis a sweep about a constant force and
releases, and in SI units a sweep with added mass: `propose_experiment` predicts by simulation how well each
discriminates the rivals. Nothing exceeds the level already recorded. Commands are in the unit of the model's commands.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.excitation import apply_fades, make_log_sweep, make_sine
from equalizer.signals.signal import FloatArray

LOWEST_HZ, LOWEST_SHARE = 1.0, 0.1
"""Lowest frequency of sweeps: in Hz, or as a share of their usual upper end; the lower of the two. The numbers of this
module are chosen by hand."""
SWEEP_CYCLES, LONG_SWEEP_FACTOR = 8.0, 5.0
"""Length of an experiment in cycles of the sweep's lowest frequency, and the factor on it for the long sweep."""
USUAL_END_HZ, USUAL_END_SHARE, WIDE_END_SHARE = 240.0, 0.24, 0.45
"""Upper end of sweeps: in Hz, or as a share of the sample rate, the lower of the two; and that of wide sweeps, as a
share of the sample rate, below half of it."""
ADDED_MASS_SHARE = 0.12
"""Known mass (or inertia) to attach, relative to the mean mass at the driven axes."""
RELEASE_COUNT = 4
"""Releases of the deflected handle in a free-decay experiment, to either side in turn."""
_FADE_SHARE = 1 / 16
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


def list_experiments(model: MechanicalModel, sample_rate_hz: float, axis: int, level: float) -> tuple[Experiment, ...]:
    """List the experiments that can be proposed. axis: index of the driven axis on which the rivals act. level: largest
    command recorded on it, above 0; no experiment exceeds it."""
    usual_end_hz = min(USUAL_END_HZ, USUAL_END_SHARE * sample_rate_hz)
    wide_end_hz = WIDE_END_SHARE * sample_rate_hz
    lowest_hz = min(LOWEST_HZ, LOWEST_SHARE * usual_end_hz)
    length_s = SWEEP_CYCLES / lowest_hz
    fade_samples = int(_FADE_SHARE * length_s * sample_rate_hz)
    sinusoid_hz = 4.0 / length_s  # four cycles per experiment

    def drive_axis(waveform: FloatArray) -> FloatArray:
        return np.outer(apply_fades(waveform, fade_samples, fade_samples), np.arange(model.inputs) == axis)

    def make_sweep(peak: float, highest_hz: float = usual_end_hz, length_factor: float = 1.0) -> FloatArray:
        sample_count = int(length_factor * length_s * sample_rate_hz)
        return drive_axis(make_log_sweep(lowest_hz, highest_hz, peak, sample_count, sample_rate_hz))

    def make_sinusoid(peak: float) -> FloatArray:
        return drive_axis(make_sine(sinusoid_hz, peak, int(length_s * sample_rate_hz), sample_rate_hz))

    sweep, wide_sweep = (f"a sweep from {lowest_hz:.3g} to {end_hz:.3g} Hz" for end_hz in (usual_end_hz, wide_end_hz))
    level_words = {1: "the highest level so far", 4: "a quarter of the highest level", 20: "a twentieth of it"}
    sweeps = (
        Experiment(f"{sweep} at {level / divisor:.3g}, {words}", make_sweep(level / divisor), "sweep")
        for divisor, words in level_words.items()
    )
    is_stiff = _is_stiff(model, axis, lowest_hz)
    static_experiments = _list_static_experiments(sweep, level, make_sweep(level / 2), fade_samples) if is_stiff else ()
    sinusoid_words, long_s = f"a slow sinusoid of {sinusoid_hz:.3g} Hz", LONG_SWEEP_FACTOR * length_s
    small_sinusoid_words = f"{sinusoid_words} at {level / 10:.3g}, so small that the device hardly moves"
    long_sweep_words = f"{wide_sweep} at {level:.3g} that lasts {long_s:.3g} s"
    return (
        *sweeps,
        Experiment(f"{wide_sweep} at {level:.3g}", make_sweep(level, wide_end_hz), "sweep"),
        Experiment(f"{sinusoid_words} at {level:.3g}", make_sinusoid(level), "slow"),
        Experiment(small_sinusoid_words, make_sinusoid(level / 10), "slow"),
        Experiment(long_sweep_words, make_sweep(level, wide_end_hz, LONG_SWEEP_FACTOR), "sweep", minutes=1.5),
        *static_experiments,
        *_list_mass_experiments(model, f"{sweep} at {level:.3g}", make_sweep(level)),
    )


def _is_stiff(model: MechanicalModel, axis: int, lowest_hz: float) -> bool:
    """Whether a constant force deflects the axis at most twice as far as a sinusoid of the sweep's lowest frequency:
    an axis without stiffness, or with little, would be driven away. From the static compliance b' K^-1 b and the
    dynamic one b' (M s^2 + D s + K)^-1 b, with b the axis; False where a matrix is singular or the static compliance is
    not positive."""
    input_vector = compute_driven_axes(model)[:, axis]
    s = 2j * np.pi * lowest_hz
    try:
        static_compliance = np.linalg.solve(model.stiffness, input_vector)
        dynamic_compliance = np.linalg.solve(model.mass * s**2 + model.damping * s + model.stiffness, input_vector)
    except np.linalg.LinAlgError:
        return False
    return bool(0 < input_vector @ static_compliance <= 2 * abs(input_vector @ dynamic_compliance))


def _list_static_experiments(
    sweep: str, level: float, half_sweep: FloatArray, fade_samples: int
) -> tuple[Experiment, Experiment]:
    """List two experiments with a static force: a sweep about another position, and releases from deflection. sweep:
    its description. half_sweep: (n, m), the sweep at half the level."""
    axis_mask = (np.abs(half_sweep).max(axis=0) > 0).astype(np.float64)
    sample_count = len(half_sweep)
    constant_force = apply_fades(np.full(sample_count, level / 2), fade_samples, fade_samples)
    return (
        Experiment(
            f"{sweep} at {level / 2:.3g} in addition to a constant force of the same size, which moves the device to "
            "another place",
            half_sweep + np.outer(constant_force, axis_mask),
            "sweep",
        ),
        Experiment(
            f"{RELEASE_COUNT} releases: a force that grows slowly to {level:.3g}, in alternating directions, and ends "
            "abruptly",
            np.outer(_make_release_command(level, sample_count), axis_mask),
            "step",
        ),
    )


def _make_release_command(level: float, max_sample_count: int) -> FloatArray:
    """Make (n,), in the command's unit: ramps up to the level, in either direction in turn, each followed by zero force
    for as long, in which the device decays freely. n is at most `max_sample_count`."""
    ramp_samples = max_sample_count // (2 * RELEASE_COUNT)
    ramp = np.append(np.linspace(0.0, level, ramp_samples), np.zeros(ramp_samples))
    signs = [1.0 if index % 2 == 0 else -1.0 for index in range(RELEASE_COUNT)]
    return np.concatenate([sign * ramp for sign in signs])


def _compute_driven_mass(model: MechanicalModel) -> float:
    """Compute the mean of the mass matrix's diagonal at the driven axes, in kg or kg m^2."""
    input_matrix = compute_driven_axes(model)
    return float(np.diagonal(input_matrix.T @ model.mass @ input_matrix).mean())


def _list_mass_experiments(model: MechanicalModel, sweep: str, command: FloatArray) -> tuple[Experiment, ...]:
    """List the sweep with a known mass (kg, shown in g) or inertia (kg m^2) attached. Empty for a model outside SI: its
    mass is in another unit, such as A s^2/m, to which a weighed mass cannot be added. sweep: its description."""
    if model.system.rotational is None:
        return ()
    added_mass = ADDED_MASS_SHARE * _compute_driven_mass(model)
    mass_text = (
        f"a known inertia of {added_mass:.2g} kg m^2 on the lever"
        if model.system.rotational
        else f"{1e3 * added_mass:.0f} g strapped to the handle"
    )
    return (Experiment(f"{sweep} with {mass_text}", command, "sweep", added_mass, minutes=3.0),)
