"""Faults of the drive (amplifier, motor), injected by altering the recorded command (inverse injection).

The measured motion is unchanged. A drive with the characteristic g would have needed the command u' with g(u') = u for
the recorded command u, and u' replaces u. Saturation, slew limit and quantization have no unique inverse: their
commands are approximations. The size of a fault grows exponentially with its strength, 0 to 1: a factor r**strength
spans the ratio r. All ranges were chosen by hand. A constant command gives a quantization step of 0, which changes
nothing; a largest command of 0 counts as 1.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.axis_motion import AxisMotion

Values = Mapping[str, float]
"""Parameters of a fault by name, in the units of the recording; times in s."""
NEWTON_STEPS = 60
"""Newton steps of the inversion of a cubic gain: far more than it needs to converge."""
LIMIT_PLACEMENT_QUANTILE = 0.98
"""Quantile of the command's magnitude, or of its steps, at which a saturation or a slew limit is placed, so that it is
reached, but rarely. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class ForceInjection:
    """A fault that is injected by altering the command."""

    effect: str
    """Name in the catalogue of effects, or a new name for an effect that is not in it."""
    draw: Callable[[AxisMotion, float, np.random.Generator], dict[str, float]]
    """Draws the parameters for a motion and a strength, 0 (weakest) to 1."""
    command: Callable[[AxisMotion, Values], FloatArray]
    """(n,): the command that would have been needed with the fault."""
    actuator: bool = False
    """Whether the fault is in the drive; it is not applicable to recordings with imposed motion."""
    memory: bool = False
    """Whether the fault depends on earlier samples; each take is then altered separately."""


def compute_centred_rms(samples: FloatArray) -> float:
    """Compute the root mean square about the mean of samples (n,), in their unit."""
    return float(np.sqrt(np.mean((samples - samples.mean()) ** 2)))


def compute_force_level(motion: AxisMotion, strength: float) -> float:
    """Compute the rms of the injected force, in the command's unit: from a fiftieth of the command's rms about its mean
    (strength 0) to all of it (1), logarithmic in the strength."""
    return compute_centred_rms(motion.command) * float(0.02 * 50.0**strength)


def delay_samples(samples: FloatArray, sample_count: float) -> FloatArray:
    """Delay samples (n,) by sample_count (negative: advance), interpolated linearly; the end values are repeated."""
    sample_numbers = np.arange(len(samples), dtype=np.float64)
    return np.asarray(np.interp(sample_numbers - sample_count, sample_numbers, samples))


def _invert_cubic_gain(motion: AxisMotion, values: Values) -> FloatArray:
    """Solve u' + cubic u'^3 = u for the command u' (n,) by Newton iteration from u."""
    command = motion.command.copy()
    for _ in range(NEWTON_STEPS):
        command -= (command + values["cubic"] * command**3 - motion.command) / (1 + 3 * values["cubic"] * command**2)
    return command


def _quantize_command(motion: AxisMotion, values: Values) -> FloatArray:
    """Round the command to multiples of the step; unchanged where the step is 0."""
    step = values["step"]
    return np.asarray(step * np.round(motion.command / step)) if step else motion.command


def _draw_saturation(motion: AxisMotion, strength: float, generator: np.random.Generator) -> dict[str, float]:
    """Draw the limit of the force, and the relative increase of the command where it is reached ("more", 0.05 to 1)."""
    force_limit = float(np.quantile(np.abs(motion.command), LIMIT_PLACEMENT_QUANTILE))
    return {"limit": force_limit, "more": float(0.05 * 20.0**strength)}


def _invert_saturation(motion: AxisMotion, values: Values) -> FloatArray:
    """Increase the command wherever it reaches 97 % of the limit (3 % tolerance, for noise in a recorded command)."""
    is_saturated = np.abs(motion.command) >= 0.97 * values["limit"]
    return np.asarray(np.where(is_saturated, motion.command * (1 + values["more"]), motion.command))


def _draw_slew_limit(motion: AxisMotion, strength: float, generator: np.random.Generator) -> dict[str, float]:
    """Draw the highest rate of the force (unit per s; 0 for a constant command), and the fraction of it from which the
    force counts as limited ("from"): 0.95 at strength 0, 0.3 at 1."""
    step_sizes = np.abs(np.diff(motion.command))
    limit_step = float(np.quantile(step_sizes[step_sizes > 0], LIMIT_PLACEMENT_QUANTILE)) if step_sizes.any() else 0.0
    return {"rate": limit_step * motion.rate_hz, "from": 1.0 - 0.05 * 14.0**strength}


def _invert_slew_limit(motion: AxisMotion, values: Values) -> FloatArray:
    """Make a command that steps at once to the end of each stretch of two or more steps in one direction, each at
    `from` times the rate `rate` or faster."""
    command_steps = np.diff(motion.command)
    is_limited = np.abs(command_steps) * motion.rate_hz >= values["from"] * values["rate"]
    is_continued = is_limited[1:] & is_limited[:-1] & (command_steps[1:] * command_steps[:-1] > 0)
    command = motion.command.copy()
    for index in np.flatnonzero(is_continued)[::-1]:
        command[index + 1] = command[index + 2]
    return command


def _compute_median_rad_per_s(samples: FloatArray, rate_hz: float) -> float:
    """Compute the angular frequency (rad/s) below which half of the power lies, the mean removed; at least that of the
    first line of the spectrum."""
    power = np.abs(np.fft.rfft(samples - samples.mean())) ** 2
    median_line = int(np.searchsorted(np.cumsum(power), power.sum() / 2))
    return 2 * np.pi * max(median_line, 1) * rate_hz / len(samples)


DRIVE_INJECTIONS: tuple[ForceInjection, ...] = (
    ForceInjection(
        "force_gain",
        lambda motion, strength, generator: {"gain": float(1 + generator.choice((-0.5, 1.0)) * 0.02 * 40.0**strength)},
        lambda motion, values: motion.command / values["gain"],
        actuator=True,
    ),
    ForceInjection(
        "force_offset",
        lambda motion, strength, generator: {
            "offset": float(generator.choice((-1.0, 1.0))) * compute_force_level(motion, strength)
        },
        lambda motion, values: motion.command - values["offset"],
        actuator=True,
    ),
    ForceInjection(
        "transport_delay",
        lambda motion, strength, generator: {
            "delay": max(0.3 * 0.02 * 50.0**strength / _compute_median_rad_per_s(motion.command, motion.rate_hz), 1e-9)
        },
        lambda motion, values: delay_samples(motion.command, -values["delay"] * motion.rate_hz),
        actuator=True,
        memory=True,
    ),
    ForceInjection(
        "amplifier_lag",
        lambda motion, strength, generator: {
            "time_constant": 0.3 * 0.02 * 50.0**strength / _compute_median_rad_per_s(motion.command, motion.rate_hz)
        },
        lambda motion, values: motion.command + values["time_constant"] * np.gradient(motion.command) * motion.rate_hz,
        actuator=True,
        memory=True,
    ),
    ForceInjection("force_saturation", _draw_saturation, _invert_saturation, actuator=True),
    ForceInjection("slew_limit", _draw_slew_limit, _invert_slew_limit, actuator=True, memory=True),
    ForceInjection(
        "force_quantization",
        lambda motion, strength, generator: {"step": compute_force_level(motion, 0.3 + 0.7 * strength)},
        _quantize_command,
        actuator=True,
    ),
    ForceInjection(
        "force_deadband",
        lambda motion, strength, generator: {"width": 0.5 * compute_force_level(motion, strength)},
        lambda motion, values: motion.command + values["width"] * np.sign(motion.command),
        actuator=True,
    ),
    ForceInjection(
        "actuator_cubic",
        lambda motion, strength, generator: {
            "cubic": 0.02 * 30.0**strength / (float(np.abs(motion.command).max()) or 1.0) ** 2
        },
        _invert_cubic_gain,
        actuator=True,
    ),
    ForceInjection(
        "force_gain_drift",
        lambda motion, strength, generator: {"change": float(generator.choice((-0.5, 1.0))) * 0.05 * 20.0**strength},
        lambda motion, values: motion.command / (1 + values["change"] * motion.normalised_time),
        actuator=True,
    ),
)
"""Faults of the drive: name, draw of the parameters, and the command that would have been needed. The gain differs from
1 by 2 to 80 % upwards, by half as much downwards. Delay and time constant are 0.006 to 0.3 of the period of the median
frequency over 2 pi; the quantization step is `compute_force_level` at strengths from 0.3 to 1, the width of the dead
band half of it at 0 to 1; the cubic term is 2 to 60 % of the largest command, the gain drift 5 to 100 % (half as much
where it is negative)."""
