"""Control inputs: recordings and models altered such that the correct answer changes in a known way, or not at all.

Negative controls (shuffled, silent, model of another device) must not be explained by an effect. Symmetry controls
(axes exchanged, signs mirrored, names changed) must give the corresponding answer. The claims are judged in
`analysis.evaluation.blind_test.controlled`.
"""

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
"""Effect and strength of most control cases; the effect acts on a single axis, and no other effect resembles it."""
PUSHED = "constant_force"
"""Effect of the control whose signs are mirrored."""
WRONG = "mains_hum"
"""The only hypothesis in the control with a wrong catalogue."""


@dataclass(frozen=True, slots=True, eq=False)
class ControlInput:
    """Input of a diagnosis."""

    recording: Recording
    model: MechanicalModel
    without: tuple[str, ...] = ()
    """Effects that the diagnosis must not consider."""


@dataclass(frozen=True, slots=True)
class Control:
    """A control: inputs, and the claim that must hold for the answers to them."""

    name: str
    claim: str
    """Name of the claim in `analysis.evaluation.blind_test.controlled.CLAIMS`."""
    draw: Callable[[int, Rig], tuple[ControlInput, ...]]
    """Makes the inputs from a seed and a rig."""


def _draw_strong(seed: int, rig: Rig) -> Case:
    """A case with the effect `CONCEALED` at strength `STRONG`."""
    return draw_case(seed, (CONCEALED,), "calibrated", STRONG, "a", rig)


def _draw_clean(seed: int, rig: Rig) -> Case:
    """A case in which the model lacks nothing."""
    return draw_case(seed, (), "calibrated", None, "a", rig)


def _plain_input(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """A case in which the model lacks nothing, unchanged."""
    case = _draw_clean(seed, rig)
    return (ControlInput(case.recording, case.model),)


def _shuffle_in_time(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """Response and position in a random order of the samples, the same for both; the command is unchanged."""
    case = _draw_strong(seed, rig)
    order = np.random.default_rng(seed).permutation(len(case.recording))
    return (ControlInput(_map_samples(case.recording, lambda samples: samples[order], command=False), case.model),)


def _other_model_input(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """Recording of a device with the model of another device, whose stated tolerances are as tight."""
    return (ControlInput(_draw_strong(seed, rig).recording, _draw_clean(seed + 1, rig).model),)


def _silent_input(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """A recording of sensor noise alone, with zero command and no position."""
    case, random = _draw_clean(seed, rig), np.random.default_rng(seed)
    shape = case.recording.response.samples.shape
    noise = np.array(NOISE_MPS2)[list(rig.axes)] * random.normal(size=shape)
    recording = replace(
        case.recording,
        command=_replace_samples(case.recording.command, np.zeros(shape)),
        response=_replace_samples(case.recording.response, noise),
        position=None,
        segments=(),
    )
    return (ControlInput(recording, case.model),)


def _permute_channels(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """Channels of command, response and position in reverse order; each keeps its name."""
    two = replace(rig, axes=(0, 1))
    case = _draw_strong(seed, two)
    recording, model = case.recording, case.model
    if recording.position is None:
        return ()
    turned = replace(
        recording,
        command=_reverse_channels(recording.command),
        response=_reverse_channels(recording.response),
        position=_reverse_channels(recording.position),
    )
    other = replace(model, input=model.input[:, ::-1], output=model.output[::-1])
    return ControlInput(recording, model), ControlInput(turned, other)


def _exchange_axes(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """The readings of two axes exchange their names, in command, response, position and model."""
    two = replace(rig, axes=(0, 1))
    case = _draw_strong(seed, two)
    turned = _map_samples(case.recording, lambda samples: samples[:, ::-1])
    other = replace(case.model, input=case.model.input[:, ::-1], output=case.model.output[::-1])
    return ControlInput(case.recording, case.model), ControlInput(turned, other)


def _mirror_signs(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """A recording with a constant force, and the same with command, response and position negated."""
    case = draw_case(seed, (PUSHED,), "calibrated", STRONG, "a", rig)
    turned = _map_samples(case.recording, lambda samples: -samples)
    return ControlInput(case.recording, case.model), ControlInput(turned, case.model)


def _exclude_irrelevant(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """The same input without and with the hypotheses of the sensor, none of which is the concealed effect."""
    case = _draw_strong(seed, rig)
    irrelevant = tuple(effect_name.name for effect_name in EFFECT_NAMES if effect_name.place == "sensor")
    return ControlInput(case.recording, case.model, irrelevant), ControlInput(case.recording, case.model)


def _rename_channels(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """The same data under other names of device and channels."""
    case = _draw_strong(seed, rig)
    recording, new = case.recording, tuple(f"q{number}" for number in range(len(rig.axes)))
    other = replace(
        recording,
        device="another",
        command=replace(recording.command, channels=tuple(f"f{name}" for name in new)),
        response=replace(recording.response, channels=tuple(f"a{name}" for name in new)),
        position=None if recording.position is None else replace(recording.position, channels=new),
    )
    return ControlInput(recording, case.model), ControlInput(other, replace(case.model, name="another"))


def _allow_one_wrong(seed: int, rig: Rig) -> tuple[ControlInput, ...]:
    """The diagnosis may consider the effect `WRONG` only, which is not the concealed effect."""
    case = _draw_strong(seed, rig)
    return (
        ControlInput(
            case.recording,
            case.model,
            tuple(effect_name.name for effect_name in EFFECT_NAMES if effect_name.name != WRONG),
        ),
    )


def _map_samples(recording: Recording, how: Callable[[FloatArray], FloatArray], command: bool = True) -> Recording:
    """The recording with `how` applied to response and position, and to the command if `command` is True."""
    position = recording.position
    return replace(
        recording,
        command=_replace_samples(recording.command, how(recording.command.samples)) if command else recording.command,
        response=_replace_samples(recording.response, how(recording.response.samples)),
        position=None if position is None else _replace_samples(position, how(position.samples)),
    )


def _replace_samples(signal: Signal, samples: FloatArray) -> Signal:
    return Signal(samples, signal.sample_rate_hz, signal.quantity, signal.unit, signal.channels)


def _reverse_channels(signal: Signal) -> Signal:
    return Signal(signal.samples[:, ::-1], signal.sample_rate_hz, signal.quantity, signal.unit, signal.channels[::-1])


CONTROLS = (
    Control("a recording shuffled in time", "no name", _shuffle_in_time),
    Control("the model of another device", "not explained", _other_model_input),
    Control("a silent recording", "no name", _silent_input),
    Control("axes in another order", "same", _permute_channels),
    Control("axes exchanged", "axis exchanged", _exchange_axes),
    Control("everything mirrored", "opposite", _mirror_signs),
    Control("strength zero", "nothing", _plain_input),
    Control("irrelevant hypotheses added", "same", _exclude_irrelevant),
    Control("other names of device and channels", "same but axes", _rename_channels),
    Control("a catalogue of one wrong hypothesis", "not explained", _allow_one_wrong),
)
"""All controls: name, claim, and how their inputs are drawn."""
