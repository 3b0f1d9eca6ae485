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
from study.evaluation.challenge.law_kernel import law_force, law_memory
from study.evaluation.challenge.laws.concealed_laws import LawKind, Random, Sizes
from study.evaluation.challenge.mechanism_kernel import Motion

WEAKEST, STRONGEST = 0.015, 0.25
"""Rms of a law relative to that of the commands, or of the readings, at strength 0 and 1."""
OF_SOFT = 1.0
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
    device: Device, kind: LawKind, free: tuple[Motion, FloatArray], places: tuple[int, int], strength: float,
    random: Random,
) -> tuple[Device, LawTruth]:  # fmt: skip
    """The device with the law, and its label. free: motion and commands (samples, 3) without the law. places: the axis
    of the law, and another axis. strength: 0 to 1."""
    moved, command = free
    axis, other = places
    sizes = Sizes(
        *(float(np.abs(part[:, axis]).max()) for part in (moved.position, moved.velocity, moved.acceleration))
    )
    first, second = kind.draw(random, sizes)
    side = float(random.choice((-1.0, 1.0)))
    share = WEAKEST * (STRONGEST / WEAKEST) ** strength
    if kind.change is not None:
        device, size = _build_change(device, kind, (moved, command), places, (first, second, side, share))
    else:
        row = np.array([kind.code, axis, other, 1.0, first, second, side])
        size = share * _rms(command[:, axis]) / _rms(_force_along_motion(row, moved, command))
        rows = [[kind.code, axis, other, size, first, second, side]]
        if kind.both:
            rows.append([kind.code, other, axis, size, first, second, -side])
        device = replace(device, laws=np.array(rows))
    numbers = {"k": abs(float(size)), "a": first, "b": second, "s": side}
    return device, _truth(kind, places, numbers)


def _truth(kind: LawKind, places: tuple[int, int], numbers: dict[str, float]) -> LawTruth:
    """The label of a law at these axes."""
    turned = (places, places[::-1]) if kind.both else (places,)
    readings = tuple(
        tuple(_with_axis_names(reading, own, other) for reading in kind.variables) for own, other in turned
    )
    return LawTruth(
        kind.name, kind.formula, tuple(AXES[own] for own, _ in turned), kind.acts_on, readings, kind.memory, numbers
    )


def _with_axis_names(reading: str, own: int, other: int) -> str:
    """Variables such as "vx vy", with x and y replaced by the letters of the axes `own` and `other`."""
    letters = {"x": AXES[own], "y": AXES[other]}
    names = [name if name == "t" else name[:-1] + letters[name[-1]] for name in reading.split()]
    return " ".join(sorted(names))


def _build_change(
    device: Device,
    kind: LawKind,
    free: tuple[Motion, FloatArray],
    places: tuple[int, int],
    numbers: tuple[float, float, float, float],
) -> tuple[Device, float]:
    """Build in a law that changes commands or readings; returns the device and the size of the law. numbers: parameters
    a and b, sign, and share (rms of the change relative to the signal). A law with a > 0 has the size `OF_SOFT`."""
    change, (axis, other), (moved, command) = kind.change, places, free
    first, second, side, share = numbers
    assert change is not None
    argument = moved.acceleration if kind.acts_on == ("response",) else command
    added = _rms(change(argument[:, axis], argument[:, other], first, second))
    size = OF_SOFT if first > 0 else side * share * _rms(argument[:, axis]) / added

    def become(samples: FloatArray) -> FloatArray:
        changed = samples.copy()
        changed[:, axis] += size * change(samples[:, axis], samples[:, other], first, second)
        return changed

    if kind.acts_on == ("response",):
        return replace(device, sensor=replace(device.sensor, law=become)), size
    return replace(device, drive_law=become), size


def _force_along_motion(row: FloatArray, moved: Motion, command: FloatArray) -> FloatArray:
    """(samples,), N: force of the law (a row of `law_kernel`) along the given motion and command."""
    kept, force = 0.0, np.zeros(len(command))
    for k in range(len(command)):
        q, v, drive = moved.position[k], moved.velocity[k], command[k]
        force[k] = law_force(row, q, v, drive, kept, k / RATE_HZ)
        kept = law_memory(row, q, drive, kept, 1 / RATE_HZ)
    return force


def _rms(samples: FloatArray) -> float:
    """Root mean square, with a tiny lower limit so that it can be divided by."""
    return max(float(np.sqrt(np.mean(samples**2))), 1e-300)
