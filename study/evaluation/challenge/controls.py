"""Control inputs: recordings, models or hypotheses such that the correct answer is known, or how it changes.

Negative controls (shuffled, silent, model of another device, wrong hypothesis) must not be explained by an effect.
Symmetry controls (axes exchanged, signs mirrored, names changed) must give the corresponding answer. The claims are
judged in `analysis.evaluation.blind_test.control_claims`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.draw_case import Case, draw_case
from study.evaluation.challenge.sensor import NOISE_MPS2

CONTROL_EFFECT, CONTROL_STRENGTH = "force_saturation", 0.9
"""Effect and strength (0 to 1) of most control cases: it acts on a single axis, and no other effect resembles it.
Chosen."""
MIRRORED_EFFECT = "constant_force"
"""Effect of the control whose signs are mirrored."""
WRONG_EFFECT = "mains_hum"
"""The only hypothesis in the control with a wrong catalogue."""


@dataclass(frozen=True, slots=True, eq=False)
class ControlInput:
    """Input of one diagnosis of a control."""

    recording: Recording
    model: MechanicalModel
    excluded_effects: tuple[str, ...] = ()
    """Effects that the diagnosis must not consider."""


@dataclass(frozen=True, slots=True)
class Control:
    """A control: inputs, and the claim that must hold for the answers to them."""

    name: str
    claim: str
    """Name of the claim in `analysis.evaluation.blind_test.control_claims.CLAIMS`."""
    draw: Callable[[int, CaseSettings], tuple[ControlInput, ...]]
    """Makes the inputs from a seed and the settings of a case."""


def _draw_control_case(seed: int, settings: CaseSettings) -> Case:
    """Draw a case with the effect `CONTROL_EFFECT` at strength `CONTROL_STRENGTH`."""
    return draw_case(seed, (CONTROL_EFFECT,), "calibrated", CONTROL_STRENGTH, "a", settings)


def _draw_intact_case(seed: int, settings: CaseSettings) -> Case:
    """Draw a case in which the model lacks nothing."""
    return draw_case(seed, (), "calibrated", None, "a", settings)


def _draw_intact_input(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Make an input from a case in which the model lacks nothing, unchanged."""
    case = _draw_intact_case(seed, settings)
    return (ControlInput(case.recording, case.model),)


def _shuffle_samples(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Put the samples of response and position in a random order, the same for both; the command is unchanged."""
    case = _draw_control_case(seed, settings)
    sample_order = np.random.default_rng(seed).permutation(len(case.recording))
    return (
        ControlInput(_map_samples(case.recording, lambda samples: samples[sample_order], command=False), case.model),
    )


def _exchange_models(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Combine the recording of a device with the calibrated model of another device."""
    return (ControlInput(_draw_control_case(seed, settings).recording, _draw_intact_case(seed + 1, settings).model),)


def _draw_sensor_noise(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Draw a recording of sensor noise alone, with zero command and no position."""
    case, random = _draw_intact_case(seed, settings), np.random.default_rng(seed)
    shape = case.recording.response.samples.shape
    noise = np.array(NOISE_MPS2)[list(settings.axes)] * random.normal(size=shape)
    recording = replace(
        case.recording,
        command=_replace_samples(case.recording.command, np.zeros(shape)),
        response=_replace_samples(case.recording.response, noise),
        position=None,
        segments=(),
    )
    return (ControlInput(recording, case.model),)


def _permute_channels(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Make a case with two axes, and the same with the channels of command, response, position and model in reverse
    order, each with its name; no inputs where the case has no position."""
    two_axis_settings = replace(settings, axes=(0, 1))
    case = _draw_control_case(seed, two_axis_settings)
    recording, model = case.recording, case.model
    if recording.position is None:
        return ()
    permuted = replace(
        recording,
        command=_reverse_channels(recording.command),
        response=_reverse_channels(recording.response),
        position=_reverse_channels(recording.position),
    )
    permuted_model = replace(model, input=model.input[:, ::-1], output=model.output[::-1])
    return ControlInput(recording, model), ControlInput(permuted, permuted_model)


def _exchange_axes(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Make a case with two axes, and the same with the data of the axes exchanged under the same channel names, in
    command, response, position and model."""
    two_axis_settings = replace(settings, axes=(0, 1))
    case = _draw_control_case(seed, two_axis_settings)
    exchanged = _map_samples(case.recording, lambda samples: samples[:, ::-1])
    exchanged_model = replace(case.model, input=case.model.input[:, ::-1], output=case.model.output[::-1])
    return ControlInput(case.recording, case.model), ControlInput(exchanged, exchanged_model)


def _mirror_signs(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Make a recording with a constant force, and the same with command, response and position negated."""
    case = draw_case(seed, (MIRRORED_EFFECT,), "calibrated", CONTROL_STRENGTH, "a", settings)
    mirrored = _map_samples(case.recording, lambda samples: -samples)
    return ControlInput(case.recording, case.model), ControlInput(mirrored, case.model)


def _add_irrelevant_hypotheses(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Give the same case twice, first with all hypotheses about the sensor excluded, then with all hypotheses; the
    concealed effect is not among those of the sensor."""
    case = _draw_control_case(seed, settings)
    sensor_effects = tuple(entry.name for entry in EFFECT_ENTRIES if entry.place == "sensor")
    return ControlInput(case.recording, case.model, sensor_effects), ControlInput(case.recording, case.model)


def _rename_channels(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Give the same data twice, the second time under other names of device and channels."""
    case = _draw_control_case(seed, settings)
    recording, channel_names = case.recording, tuple(f"q{number}" for number in range(len(settings.axes)))
    renamed = replace(
        recording,
        device="another",
        command=replace(recording.command, channels=tuple(f"f{name}" for name in channel_names)),
        response=replace(recording.response, channels=tuple(f"a{name}" for name in channel_names)),
        position=None if recording.position is None else replace(recording.position, channels=channel_names),
    )
    return ControlInput(recording, case.model), ControlInput(renamed, replace(case.model, name="another"))


def _allow_wrong_effect_only(seed: int, settings: CaseSettings) -> tuple[ControlInput, ...]:
    """Make an input for which the diagnosis may consider only `WRONG_EFFECT`, which is not the concealed effect."""
    case = _draw_control_case(seed, settings)
    return (
        ControlInput(
            case.recording,
            case.model,
            tuple(entry.name for entry in EFFECT_ENTRIES if entry.name != WRONG_EFFECT),
        ),
    )


def _map_samples(
    recording: Recording, transform: Callable[[FloatArray], FloatArray], command: bool = True
) -> Recording:
    """Return the recording with `transform` applied to response and position, and to the command if `command` is
    True."""
    position = recording.position
    return replace(
        recording,
        command=_replace_samples(recording.command, transform(recording.command.samples))
        if command
        else recording.command,
        response=_replace_samples(recording.response, transform(recording.response.samples)),
        position=None if position is None else _replace_samples(position, transform(position.samples)),
    )


def _replace_samples(signal: Signal, samples: FloatArray) -> Signal:
    """Return the signal with other samples, (n, channels)."""
    return Signal(samples, signal.sample_rate_hz, signal.quantity, signal.unit, signal.channels)


def _reverse_channels(signal: Signal) -> Signal:
    """Return the signal with the samples and the names of its channels in reverse order."""
    return Signal(signal.samples[:, ::-1], signal.sample_rate_hz, signal.quantity, signal.unit, signal.channels[::-1])


CONTROLS = (
    Control("a recording shuffled in time", "no name", _shuffle_samples),
    Control("the model of another device", "not explained", _exchange_models),
    Control("a silent recording", "no name", _draw_sensor_noise),
    Control("axes in another order", "same", _permute_channels),
    Control("axes exchanged", "axis exchanged", _exchange_axes),
    Control("everything mirrored", "opposite", _mirror_signs),
    Control("strength zero", "nothing", _draw_intact_input),
    Control("irrelevant hypotheses added", "same", _add_irrelevant_hypotheses),
    Control("other names of device and channels", "same but axes", _rename_channels),
    Control("a catalogue of one wrong hypothesis", "not explained", _allow_wrong_effect_only),
)
"""All controls: name, claim, and how their inputs are drawn."""
