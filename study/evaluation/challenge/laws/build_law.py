"""Builds a concealed law into a device, scaled so that a strength means the same on every bench.

For a law that is a force, the ratio of the rms of the force, along the motion without the law, to the rms of the
command is given by the strength; for a law of commands or readings, the ratio of the rms of the change to that of the
changed signal.
"""

from dataclasses import dataclass, replace

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ
from study.evaluation.challenge.law_kernel import advance_law_memory, compute_law_force
from study.evaluation.challenge.laws.concealed_laws import LawKind, PeakValues, Random
from study.evaluation.challenge.mechanism_kernel import Motion

WEAKEST, STRONGEST = 0.015, 0.25
"""Rms of a law relative to that of the commands, or of the readings, at strength 0 and 1."""
SOFT_LAW_SIZE = 1.0
"""Size k of a saturating law of commands or readings: its parameter a alone sets its strength."""


@dataclass(frozen=True, slots=True)
class LawTruth:
    """The label of a law that the device has and the model lacks."""

    law: str
    """Name of the law."""
    formula: str
    axes: tuple[str, ...]
    """Letters of the axes on which the law acts."""
    acts_on: tuple[str, ...]
    """Equivalent places of action: force, command or response."""
    variables: tuple[tuple[str, ...], ...]
    """Per axis of `axes`: equivalent sets of variables, each sorted and joined by spaces."""
    memory: bool
    """Whether the law depends on earlier motion or commands."""
    numbers: dict[str, float]
    """Size k, parameters a and b, sign s."""


def build_law(
    device: Device, kind: LawKind, baseline: tuple[Motion, FloatArray], places: tuple[int, int], strength: float,
    random: Random,
) -> tuple[Device, LawTruth]:  # fmt: skip
    """The device with the law, and its label. baseline: motion and commands (samples, 3) without the law. places: the
    axis of the law, and another axis. strength: 0 to 1."""
    motion, command = baseline
    axis, other_axis = places
    peaks = PeakValues(
        *(float(np.abs(part[:, axis]).max()) for part in (motion.position, motion.velocity, motion.acceleration))
    )
    first, second = kind.draw(random, peaks)
    side = float(random.choice((-1.0, 1.0)))
    share = WEAKEST * (STRONGEST / WEAKEST) ** strength
    if kind.change is not None:
        device, size = _build_change(device, kind, (motion, command), places, (first, second, side, share))
    else:
        unit_row = np.array([kind.code, axis, other_axis, 1.0, first, second, side])
        size = share * _rms(command[:, axis]) / _rms(_evaluate_force(unit_row, motion, command))
        rows = [[kind.code, axis, other_axis, size, first, second, side]]
        if kind.mutual:
            rows.append([kind.code, other_axis, axis, size, first, second, -side])
        device = replace(device, laws=np.array(rows))
    numbers = {"k": abs(float(size)), "a": first, "b": second, "s": side}
    return device, _make_truth(kind, places, numbers)


def _make_truth(kind: LawKind, places: tuple[int, int], numbers: dict[str, float]) -> LawTruth:
    """The label of a law at these axes."""
    axis_pairs = (places, places[::-1]) if kind.mutual else (places,)
    readings = tuple(
        tuple(_with_axis_names(reading, axis, other_axis) for reading in kind.variables)
        for axis, other_axis in axis_pairs
    )
    return LawTruth(
        kind.name,
        kind.formula,
        tuple(AXES[axis] for axis, _ in axis_pairs),
        kind.acts_on,
        readings,
        kind.memory,
        numbers,
    )


def _with_axis_names(reading: str, axis: int, other_axis: int) -> str:
    """Variables such as "vx vy", with x and y replaced by the letters of the axes `axis` and `other_axis`."""
    letters = {"x": AXES[axis], "y": AXES[other_axis]}
    names = [name if name == "t" else name[:-1] + letters[name[-1]] for name in reading.split()]
    return " ".join(sorted(names))


def _build_change(
    device: Device,
    kind: LawKind,
    baseline: tuple[Motion, FloatArray],
    places: tuple[int, int],
    numbers: tuple[float, float, float, float],
) -> tuple[Device, float]:
    """Build in a law that changes commands or readings; returns the device and the size of the law. numbers: parameters
    a and b, sign, and share (rms of the change relative to the signal). A law with a > 0 has the size
    `SOFT_LAW_SIZE`."""
    change, (axis, other_axis), (motion, command) = kind.change, places, baseline
    first, second, side, share = numbers
    assert change is not None
    argument = motion.acceleration if kind.acts_on == ("response",) else command
    unit_change_rms = _rms(change(argument[:, axis], argument[:, other_axis], first, second))
    size = SOFT_LAW_SIZE if first > 0 else side * share * _rms(argument[:, axis]) / unit_change_rms

    def apply_law(samples: FloatArray) -> FloatArray:
        new_samples = samples.copy()
        new_samples[:, axis] += size * change(samples[:, axis], samples[:, other_axis], first, second)
        return new_samples

    if kind.acts_on == ("response",):
        return replace(device, sensor=replace(device.sensor, law=apply_law)), size
    return replace(device, drive_law=apply_law), size


def _evaluate_force(row: FloatArray, motion: Motion, command: FloatArray) -> FloatArray:
    """(samples,), N: force of the law (a row of `law_kernel`) along the given motion and command."""
    memory, force = 0.0, np.zeros(len(command))
    for k in range(len(command)):
        q, v, drive = motion.position[k], motion.velocity[k], command[k]
        force[k] = compute_law_force(row, q, v, drive, memory, k / RATE_HZ)
        memory = advance_law_memory(row, q, drive, memory, 1 / RATE_HZ)
    return force


def _rms(samples: FloatArray) -> float:
    """Root mean square, with a tiny lower limit so that it can be divided by."""
    return max(float(np.sqrt(np.mean(samples**2))), 1e-300)
