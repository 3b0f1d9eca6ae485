"""Build a law into a device, scaled so that the ratio of its rms force to that of the commands is the same on every
bench."""

from dataclasses import dataclass, replace

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ
from study.evaluation.challenge.law_kernel import law_force, law_memory
from study.evaluation.challenge.laws.concealed_laws import LawKind, Random, Sizes
from study.evaluation.challenge.mechanism_kernel import Motion

WEAKEST, STRONGEST = 0.015, 0.25
"""Size of a law relative to the rms of the commands, or of the readings."""
OF_SOFT = 1.0
"""Size of a saturating curve, whose own parameter sets how far it bends."""


@dataclass(frozen=True, slots=True)
class LawTruth:
    """The label of one law that the device has and the model lacks."""

    law: str
    formula: str
    axes: tuple[str, ...]
    acts_on: tuple[str, ...]
    variables: tuple[tuple[str, ...], ...]
    """Per axis of `axes`: equivalent sets of variables, each sorted and joined by spaces."""
    memory: bool
    numbers: dict[str, float]


def build_law(
    device: Device, kind: LawKind, free: tuple[Motion, FloatArray], places: tuple[int, int], strength: float,
    random: Random,
) -> tuple[Device, LawTruth]:  # fmt: skip
    """The device with the law, and its label. free: motion and commands without it. places: its axis, and another
    axis."""
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
    numbers = {"k": float(size), "a": first, "b": second, "s": side}
    return device, _truth(kind, places, numbers)


def _truth(kind: LawKind, places: tuple[int, int], numbers: dict[str, float]) -> LawTruth:
    turned = (places, places[::-1]) if kind.both else (places,)
    readings = tuple(
        tuple(_with_axis_names(reading, own, other) for reading in kind.variables) for own, other in turned
    )
    return LawTruth(
        kind.name, kind.formula, tuple(AXES[own] for own, _ in turned), kind.acts_on, readings, kind.memory, numbers
    )


def _with_axis_names(reading: str, own: int, other: int) -> str:
    """Variables such as "vx vy" with the letters of the actual axes."""
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
    """Build a law that alters commands or readings; returns the device and the law's size. numbers: a, b, side,
    share."""
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
    """(samples,): force of the law along the given motion."""
    kept, force = 0.0, np.zeros(len(command))
    for k in range(len(command)):
        q, v, drive = moved.position[k], moved.velocity[k], command[k]
        force[k] = law_force(row, q, v, drive, kept, k / RATE_HZ)
        kept = law_memory(row, q, drive, kept, 1 / RATE_HZ)
    return force


def _rms(samples: FloatArray) -> float:
    return max(float(np.sqrt(np.mean(samples**2))), 1e-300)
