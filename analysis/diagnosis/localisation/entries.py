"""Where a mismatch can enter a given model: as a force along an axis, or as an error of a sensor."""

import numpy as np

from analysis.diagnosis.errors.transfer import axis_transfer
from analysis.diagnosis.localisation.entry_point import Entry
from equalizer.effects.placing import axis_letter
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


def entries_of(
    model: MechanicalModel, recording: Recording, frequency_hz: FloatArray, position: bool
) -> tuple[Entry, ...]:
    """frequency_hz: (lines,). position: whether its channels are looked at beside the response's."""
    seen = axis_transfer(model, recording.sample_rate_hz, frequency_hz)
    forces = np.concatenate([seen.response, seen.position], axis=1) if position else seen.response
    axes = tuple(axis_letter(one, recording.command.channels) for one in recording.command.channels)
    p, channels = model.outputs, forces.shape[1]
    unit = np.eye(channels, dtype=np.complex128)[None]
    found = [Entry(f"a force along {axis}", "mechanism", axis, forces[:, :, [k]]) for k, axis in enumerate(axes)]
    found += [Entry("forces along several axes", "mechanism", None, forces)] if len(axes) > 1 else []
    found += [
        Entry(f"an error of the {name} channel", "sensor", name, unit[:, :, [k]])
        for k, name in enumerate(recording.response.channels[:p])
    ]
    found += [Entry("errors of several response channels", "sensor", None, unit[:, :, :p])] if p > 1 else []
    if position and recording.position is not None:
        found += [
            Entry(f"an error of the position channel {name}", "sensor", name, unit[:, :, [p + k]], of_position=True)
            for k, name in enumerate(recording.position.channels)
        ]
    return tuple(found)
