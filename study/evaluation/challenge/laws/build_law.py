"""Build a concealed law into a device, scaled so that a strength means the same on every bench.

For a law that is a force, the ratio of the rms of the force, along the motion without the law, to the rms of the
command is given by the strength; for a law of commands or readings, the ratio of the rms of the change to that of the
changed signal, except for a saturating law.
"""

from dataclasses import dataclass, replace

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ
from study.evaluation.challenge.law_kernel import advance_law_memory, compute_law_force
from study.evaluation.challenge.laws.concealed_laws import LawKind, PeakValues, Random
from study.evaluation.challenge.mechanism_kernel import Motion

WEAKEST_RMS_RATIO, STRONGEST_RMS_RATIO = 0.015, 0.25
"""Rms of a law relative to that of the commands, or of the readings, at strength 0 and 1. Chosen."""
SATURATING_LAW_SIZE = 1.0
"""Size k of a saturating law of commands or readings: its parameter a alone sets its strength."""


@dataclass(frozen=True, slots=True)
class LawTruth:
    """The label of a law that the device has and the model lacks."""

    law: str
    """Name of the law."""
    formula: str
    """Formula for display, see `LawKind.formula`."""
    axes: tuple[str, ...]
    """Letters of the axes on which the law acts."""
    acts_on: tuple[str, ...]
    """Equivalent places of action: force, command or response."""
    variables: tuple[tuple[str, ...], ...]
    """Per axis of `axes`: equivalent sets of variables, each sorted and joined by spaces."""
    memory: bool
    """Whether the law depends on earlier motion or commands."""
    numbers: dict[str, float]
    """By symbol of the formula: "k", magnitude of the size; parameters "a" and "b"; sign "s", +1 or -1."""


def build_law(
    device: Device, kind: LawKind, baseline: tuple[Motion, FloatArray], axis_pair: tuple[int, int], strength: float,
    random: Random,
) -> tuple[Device, LawTruth]:  # fmt: skip
    """Draw the parameters of a law and add it to a device without laws; returns the new device and the label. baseline:
    motion and commands (samples, 3), N, without the law. axis_pair: the axis of the law, and another axis, which may be
    the same for a law of one axis. strength: 0 to 1, between the two rms ratios above, geometrically."""
    baseline_motion, command = baseline
    axis, other_axis = axis_pair
    peaks = PeakValues(
        *(
            float(np.abs(quantity[:, axis]).max())
            for quantity in (baseline_motion.position, baseline_motion.velocity, baseline_motion.acceleration)
        )
    )
    parameter_a, parameter_b = kind.draw(random, peaks)
    sign = float(random.choice((-1.0, 1.0)))
    rms_ratio = WEAKEST_RMS_RATIO * (STRONGEST_RMS_RATIO / WEAKEST_RMS_RATIO) ** strength
    if kind.change is not None:
        device, law_size = _build_signal_law(
            device, kind, (baseline_motion, command), axis_pair, (parameter_a, parameter_b, sign, rms_ratio)
        )
    else:
        unit_row = np.array([kind.code, axis, other_axis, 1.0, parameter_a, parameter_b, sign])
        law_size = (
            rms_ratio
            * _compute_rms(command[:, axis])
            / _compute_rms(_evaluate_force(unit_row, baseline_motion, command))
        )
        law_rows = [[kind.code, axis, other_axis, law_size, parameter_a, parameter_b, sign]]
        if kind.mutual:
            law_rows.append([kind.code, other_axis, axis, law_size, parameter_a, parameter_b, -sign])
        device = replace(device, laws=np.array(law_rows))
    law_numbers = {"k": abs(float(law_size)), "a": parameter_a, "b": parameter_b, "s": sign}
    return device, _make_truth(kind, axis_pair, law_numbers)


def _make_truth(kind: LawKind, axis_pair: tuple[int, int], numbers: dict[str, float]) -> LawTruth:
    """Make the label of a law: per axis on which it acts, the variables by their names on that axis. axis_pair: as in
    `build_law`; numbers: see `LawTruth.numbers`."""
    axis_pairs = (axis_pair, axis_pair[::-1]) if kind.mutual else (axis_pair,)
    variables = tuple(
        tuple(_substitute_axes(variable_set, axis, other_axis) for variable_set in kind.variables)
        for axis, other_axis in axis_pairs
    )
    return LawTruth(
        kind.name,
        kind.formula,
        tuple(AXES[axis] for axis, _ in axis_pairs),
        kind.acts_on,
        variables,
        kind.memory,
        numbers,
    )


def _substitute_axes(variable_set: str, axis: int, other_axis: int) -> str:
    """Replace x and y in variables such as "vx vy" by the letters of `axis` and `other_axis`; t, the time, has none.
    Returns the variables sorted, separated by spaces."""
    letters = {"x": AXES[axis], "y": AXES[other_axis]}
    names = [name if name == "t" else name[:-1] + letters[name[-1]] for name in variable_set.split()]
    return " ".join(sorted(names))


def _build_signal_law(
    device: Device,
    kind: LawKind,
    baseline: tuple[Motion, FloatArray],
    axis_pair: tuple[int, int],
    law_parameters: tuple[float, float, float, float],
) -> tuple[Device, float]:
    """Add a law that changes commands or readings to a device; returns the device and the size of the law.
    law_parameters: parameters a and b, sign s, and rms of the change relative to the signal. A law with a > 0 has the
    size `SATURATING_LAW_SIZE`, so that neither sign nor rms ratio is used."""
    compute_change, (axis, other_axis), (motion, command) = kind.change, axis_pair, baseline
    parameter_a, parameter_b, sign, rms_ratio = law_parameters
    assert compute_change is not None
    signal = motion.acceleration if kind.acts_on == ("response",) else command
    unit_change_rms = _compute_rms(compute_change(signal[:, axis], signal[:, other_axis], parameter_a, parameter_b))
    law_size = (
        SATURATING_LAW_SIZE if parameter_a > 0 else sign * rms_ratio * _compute_rms(signal[:, axis]) / unit_change_rms
    )

    def apply_law(samples: FloatArray) -> FloatArray:
        """Add the change on the axis of the law to a copy of the commands or readings (n, 3)."""
        new_samples = samples.copy()
        new_samples[:, axis] += law_size * compute_change(
            samples[:, axis], samples[:, other_axis], parameter_a, parameter_b
        )
        return new_samples

    if kind.acts_on == ("response",):
        return replace(device, sensor=replace(device.sensor, static_law=apply_law)), law_size
    return replace(device, drive_law=apply_law), law_size


def _evaluate_force(law_row: FloatArray, motion: Motion, command: FloatArray) -> FloatArray:
    """Compute the force (samples,), N, of a law (a row of `law_kernel`) along a motion and the commands. Its memory is
    integrated once per sample."""
    memory, force = 0.0, np.zeros(len(command))
    for k in range(len(command)):
        q, v, drive_force = motion.position[k], motion.velocity[k], command[k]
        force[k] = compute_law_force(law_row, q, v, drive_force, memory, k / RATE_HZ)
        memory = advance_law_memory(law_row, q, drive_force, memory, 1 / RATE_HZ)
    return force


def _compute_rms(samples: FloatArray) -> float:
    """Compute the root mean square; at least 1e-300, so that it can be divided by."""
    return max(float(np.sqrt(np.mean(samples**2))), 1e-300)
