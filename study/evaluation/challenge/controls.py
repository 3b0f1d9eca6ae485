"""Controls: recordings and models changed so that the right answer changes with them, or must not change."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from equalizer.plant.effect_vocabulary import EFFECT_NAMES
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from study.evaluation.challenge.draw_case import Case, draw_case
from study.evaluation.challenge.rig import Rig
from study.evaluation.challenge.sensor import NOISE_MPS2

CONCEALED, STRONG = "force_saturation", 0.9
"""On one axis, and nothing else looks like it."""
PUSHED = "constant_force"
WRONG = "mains_hum"


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """What a diagnosis is given."""

    recording: Recording
    model: MechanicalModel
    without: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Control:
    """claim: how the answers are judged, in `proof.controlled`. draw: from a seed and a rig what is asked, one after
    another."""

    name: str
    claim: str
    draw: Callable[[int, Rig], tuple[Asked, ...]]


def _strong(seed: int, rig: Rig) -> Case:
    return draw_case(seed, (CONCEALED,), "calibrated", STRONG, "a", rig)


def _clean(seed: int, rig: Rig) -> Case:
    return draw_case(seed, (), "calibrated", None, "a", rig)


def _plain(seed: int, rig: Rig) -> tuple[Asked, ...]:
    case = _clean(seed, rig)
    return (Asked(case.recording, case.model),)


def _shuffled(seed: int, rig: Rig) -> tuple[Asked, ...]:
    case = _strong(seed, rig)
    order = np.random.default_rng(seed).permutation(len(case.recording))
    return (Asked(_mapped(case.recording, lambda samples: samples[order], command=False), case.model),)


def _other_model(seed: int, rig: Rig) -> tuple[Asked, ...]:
    """Its tolerances as tight as if it were this device's own."""
    return (Asked(_strong(seed, rig).recording, _clean(seed + 1, rig).model),)


def _silent(seed: int, rig: Rig) -> tuple[Asked, ...]:
    case, random = _clean(seed, rig), np.random.default_rng(seed)
    shape = case.recording.response.samples.shape
    noise = np.array(NOISE_MPS2)[list(rig.axes)] * random.normal(size=shape)
    recording = replace(
        case.recording,
        command=_with(case.recording.command, np.zeros(shape)),
        response=_with(case.recording.response, noise),
        position=None,
        segments=(),
    )
    return (Asked(recording, case.model),)


def _permuted(seed: int, rig: Rig) -> tuple[Asked, ...]:
    """The channels of command, response and position in reverse; each keeps its name."""
    two = replace(rig, axes=(0, 1))
    case = _strong(seed, two)
    recording, model = case.recording, case.model
    if recording.position is None:
        return ()
    turned = replace(
        recording,
        command=_reversed(recording.command),
        response=_reversed(recording.response),
        position=_reversed(recording.position),
    )
    other = replace(model, input=model.input[:, ::-1], output=model.output[::-1])
    return Asked(recording, model), Asked(turned, other)


def _exchanged(seed: int, rig: Rig) -> tuple[Asked, ...]:
    """What was read of one axis now bears the other's name, in command, response, position and model."""
    two = replace(rig, axes=(0, 1))
    case = _strong(seed, two)
    turned = _mapped(case.recording, lambda samples: samples[:, ::-1])
    other = replace(case.model, input=case.model.input[:, ::-1], output=case.model.output[::-1])
    return Asked(case.recording, case.model), Asked(turned, other)


def _mirrored(seed: int, rig: Rig) -> tuple[Asked, ...]:
    case = draw_case(seed, (PUSHED,), "calibrated", STRONG, "a", rig)
    turned = _mapped(case.recording, lambda samples: -samples)
    return Asked(case.recording, case.model), Asked(turned, case.model)


def _fewer(seed: int, rig: Rig) -> tuple[Asked, ...]:
    case = _strong(seed, rig)
    irrelevant = tuple(effect_name.name for effect_name in EFFECT_NAMES if effect_name.place == "sensor")
    return Asked(case.recording, case.model, irrelevant), Asked(case.recording, case.model)


def _renamed(seed: int, rig: Rig) -> tuple[Asked, ...]:
    case = _strong(seed, rig)
    recording, new = case.recording, tuple(f"q{number}" for number in range(len(rig.axes)))
    other = replace(
        recording,
        device="another",
        command=replace(recording.command, channels=tuple(f"f{name}" for name in new)),
        response=replace(recording.response, channels=tuple(f"a{name}" for name in new)),
        position=None if recording.position is None else replace(recording.position, channels=new),
    )
    return Asked(recording, case.model), Asked(other, replace(case.model, name="another"))


def _one_wrong(seed: int, rig: Rig) -> tuple[Asked, ...]:
    case = _strong(seed, rig)
    return (
        Asked(
            case.recording,
            case.model,
            tuple(effect_name.name for effect_name in EFFECT_NAMES if effect_name.name != WRONG),
        ),
    )


def _mapped(recording: Recording, how: Callable[[FloatArray], FloatArray], command: bool = True) -> Recording:
    """Response and position changed, and the command with them."""
    position = recording.position
    return replace(
        recording,
        command=_with(recording.command, how(recording.command.samples)) if command else recording.command,
        response=_with(recording.response, how(recording.response.samples)),
        position=None if position is None else _with(position, how(position.samples)),
    )


def _with(signal: Signal, samples: FloatArray) -> Signal:
    return Signal(samples, signal.sample_rate_hz, signal.quantity, signal.unit, signal.channels)


def _reversed(signal: Signal) -> Signal:
    return Signal(signal.samples[:, ::-1], signal.sample_rate_hz, signal.quantity, signal.unit, signal.channels[::-1])


CONTROLS = (
    Control("a recording shuffled in time", "no name", _shuffled),
    Control("the model of another device", "not explained", _other_model),
    Control("a silent recording", "no name", _silent),
    Control("axes in another order", "same", _permuted),
    Control("axes exchanged", "axis exchanged", _exchanged),
    Control("everything mirrored", "opposite", _mirrored),
    Control("strength zero", "nothing", _plain),
    Control("irrelevant hypotheses added", "same", _fewer),
    Control("other names of device and channels", "same but axes", _renamed),
    Control("a catalogue of one wrong hypothesis", "not explained", _one_wrong),
)
