"""Faults of the drive (amplifier, motor), injected by altering the recorded command (inverse injection).

The measured motion stays. A drive with the characteristic g would have needed the command u' with g(u') = u for the
recorded command u, and u' takes its place; see `force_injections`. Saturation, slew limit and quantization have no
unique inverse: their commands are approximations. `injections` joins them with its other injections.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.axis_motion import AxisMotion

Values = Mapping[str, float]
"""Parameters of a fault by name, in the units of the recording; times in seconds."""
NEWTON_STEPS = 60
"""Newton steps to the command that a cubic gain turns into the recorded one: far more than convergence takes."""
LIMIT_QUANTILE = 0.98
"""Quantile of the command's magnitude, or of its steps, at which a saturation or a slew limit is placed, so that it is
reached, but rarely. Chosen by hand, as are all ranges below."""


@dataclass(frozen=True, slots=True)
class ForceInjection:
    """A fault that is injected by altering the command."""

    effect: str
    """Name in the vocabulary, or a new name in its style."""
    draw: Callable[[AxisMotion, float, np.random.Generator], dict[str, float]]
    """Draws the parameters for a motion and a strength, 0 (weakest) to 1."""
    command: Callable[[AxisMotion, Values], FloatArray]
    """(n,): the command that would have been needed with the fault."""
    actuator: bool = False
    """Whether the fault is of the drive; such a fault does not exist where the motion is imposed."""
    memory: bool = False
    """Whether the fault depends on earlier samples; it then starts anew with each take."""


def rms(samples: FloatArray) -> float:
    """Root mean square about the mean."""
    return float(np.sqrt(np.mean((samples - samples.mean()) ** 2)))


def compute_force_level(motion: AxisMotion, strength: float) -> float:
    """Rms of the injected force, in the command's unit: from a fiftieth of the command's rms (strength 0) to all of it
    (1), logarithmic in the strength."""
    return rms(motion.command) * float(0.02 * 50.0**strength)


def _shift_later(samples: FloatArray, delay_samples: float) -> FloatArray:
    """Samples `delay_samples` samples later (negative: earlier), interpolated linearly."""
    index = np.arange(len(samples), dtype=np.float64)
    return np.asarray(np.interp(index - delay_samples, index, samples))


def _undo_cubic_gain(motion: AxisMotion, values: Values) -> FloatArray:
    """Command u' with u' + cubic u'^3 = u (Newton iteration)."""
    command = motion.command.copy()
    for _ in range(NEWTON_STEPS):
        command -= (command + values["cubic"] * command**3 - motion.command) / (1 + 3 * values["cubic"] * command**2)
    return command


def _draw_limit(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    """Limit of the force, and relative increase of the command where it is reached, 0.05 to 1."""
    limit = float(np.quantile(np.abs(motion.command), LIMIT_QUANTILE))
    return {"limit": limit, "more": float(0.05 * 20.0**strength)}


def _undo_saturation(motion: AxisMotion, values: Values) -> FloatArray:
    """A larger command wherever the force reached 97 % of its limit."""
    is_saturated = np.abs(motion.command) >= 0.97 * values["limit"]
    return np.asarray(np.where(is_saturated, motion.command * (1 + values["more"]), motion.command))


def _draw_slew_rate(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    """Highest rate of the force, and the fraction of it from which the force counts as limited: 0.95 down to 0.3."""
    steps = np.abs(np.diff(motion.command))
    max_step = float(np.quantile(steps[steps > 0], LIMIT_QUANTILE)) if steps.any() else 0.0
    return {"rate": max_step * motion.rate_hz, "from": 1.0 - 0.05 * 14.0**strength}


def _undo_slew_limit(motion: AxisMotion, values: Values) -> FloatArray:
    """A command that steps at once to the end of each stretch over which the force changed in one direction at about
    its highest rate."""
    steps = np.diff(motion.command)
    is_limited = np.abs(steps) * motion.rate_hz >= values["from"] * values["rate"]
    is_continued = is_limited[1:] & is_limited[:-1] & (steps[1:] * steps[:-1] > 0)
    command = motion.command.copy()
    for index in np.flatnonzero(is_continued)[::-1]:
        command[index + 1] = command[index + 2]
    return command


def _draw_gain(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    """Gain above 1 by 2 % to 80 %, or below 1 by half as much, logarithmic in the strength."""
    return {"gain": float(1 + random.choice((-0.5, 1.0)) * 0.02 * 40.0**strength)}


def _compute_median_rad_per_s(samples: FloatArray, rate_hz: float) -> float:
    """Angular frequency (rad/s) below which half of the power lies, the mean removed."""
    power = np.abs(np.fft.rfft(samples - samples.mean())) ** 2
    median_line = int(np.searchsorted(np.cumsum(power), power.sum() / 2))
    return 2 * np.pi * max(median_line, 1) * rate_hz / len(samples)


DRIVE_INJECTIONS: tuple[ForceInjection, ...] = (
    ForceInjection("force_gain", _draw_gain, lambda motion, values: motion.command / values["gain"], actuator=True),
    ForceInjection(
        "force_offset",
        lambda motion, strength, random: {
            "offset": float(random.choice((-1.0, 1.0))) * compute_force_level(motion, strength)
        },
        lambda motion, values: motion.command - values["offset"],
        actuator=True,
    ),
    ForceInjection(
        "transport_delay",
        lambda motion, strength, random: {
            "delay": max(0.3 * 0.02 * 50.0**strength / _compute_median_rad_per_s(motion.command, motion.rate_hz), 1e-9)
        },
        lambda motion, values: _shift_later(motion.command, -values["delay"] * motion.rate_hz),
        actuator=True,
        memory=True,
    ),
    ForceInjection(
        "amplifier_lag",
        lambda motion, strength, random: {
            "time_constant": 0.3 * 0.02 * 50.0**strength / _compute_median_rad_per_s(motion.command, motion.rate_hz)
        },
        lambda motion, values: motion.command + values["time_constant"] * np.gradient(motion.command) * motion.rate_hz,
        actuator=True,
        memory=True,
    ),
    ForceInjection("force_saturation", _draw_limit, _undo_saturation, actuator=True),
    ForceInjection("slew_limit", _draw_slew_rate, _undo_slew_limit, actuator=True, memory=True),
    ForceInjection(
        "force_quantization",
        lambda motion, strength, random: {"step": compute_force_level(motion, 0.3 + 0.7 * strength)},
        lambda motion, values: values["step"] * np.round(motion.command / values["step"]),
        actuator=True,
    ),
    ForceInjection(
        "force_deadband",
        lambda motion, strength, random: {"width": 0.5 * compute_force_level(motion, strength)},
        lambda motion, values: motion.command + values["width"] * np.sign(motion.command),
        actuator=True,
    ),
    ForceInjection(
        "actuator_cubic",
        lambda motion, strength, random: {"cubic": 0.02 * 30.0**strength / float(np.abs(motion.command).max()) ** 2},
        _undo_cubic_gain,
        actuator=True,
    ),
    ForceInjection(
        "force_gain_drift",
        lambda motion, strength, random: {"change": float(random.choice((-0.5, 1.0))) * 0.05 * 20.0**strength},
        lambda motion, values: motion.command / (1 + values["change"] * motion.normalised_time),
        actuator=True,
    ),
)
"""Faults of the drive: name, draw of the parameters, and the command that would have been needed."""
