"""Localise a mismatch: find the component through which it enters the model, and the states that it depends on.

`find_entry_point` compares the residual's spectra with the model's responses to a force at each axis and to an error of
each sensor (`entry_point`); `find_state_dependences` then tests the missing force against position, velocity, command
and time, or a sensor's error against reading and time (`state_dependence`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.output_error import Fitted, gather_evidence
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.forces.missing_force import compute_axis_transfer
from analysis.diagnosis.localisation.distortion import Distortions
from analysis.diagnosis.localisation.entry_point import Entry, EntryPoint, rank_entries
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell, Prediction
from analysis.diagnosis.localisation.mismatch_rows import StateMismatch
from analysis.diagnosis.localisation.residual_spectra import compute_residual_spectra
from analysis.diagnosis.localisation.state_dependence import find_error_states, find_force_states
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from equalizer.effects.placing import shorten_axis_name
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_DERIVATIVES: Mapping[str, Literal[0, 1, 2]] = {
    "position": 0, "displacement": 0, "angle": 0, "velocity": 1, "speed": 1, "acceleration": 2,
}  # fmt: skip
"""Order of the position's time derivative, by the response's quantity."""


@dataclass(frozen=True, slots=True, eq=False)
class Localisation:
    """Where a mismatch is: the states that it depends on, the component of entry, and the kinds of distortion."""

    states: Mapping[str, tuple[StateMismatch, ...]] = field(default_factory=dict)
    """Significant state dependences by model: "before" (as given), "retuned", "after" (with the effects)."""
    entry: EntryPoint | None = None
    """Entry point of the re-tuned model's residual; None as `find_entry_point`."""
    distortions: Distortions = field(default_factory=lambda: Distortions((), ()))
    """Distortion of all recordings (`find_distortions`)."""


def find_entry_point(
    measure: ErrorMeasure,
    tuning: Tuning,
    fitted: Fitted,
    floors: Sequence[NoiseFloor],
    cells: Sequence[MismatchCell],
) -> EntryPoint | None:
    """Find the entry point of the residual of the recording with the largest error (`_find_worst_record`). fitted: the
    re-tuned model; floors: noise of each recording; cells: mismatch map of the re-tuned model. None where no cell
    exceeds the noise, no free simulation was compared, or the spectra cannot be computed
    (`compute_residual_spectra`)."""
    if measure.name != "free simulation" or not any(cell.beyond_noise for cell in cells):
        return None
    record_index = _find_worst_record(cells)
    record = measure.records[record_index]
    recording, response_count = record.recording, record.recording.response.samples.shape[1]
    predicted = record.measured - fitted.residuals[record_index] * measure.unit
    position = predicted[:, response_count:] if predicted.shape[1] > response_count else None
    spectra = compute_residual_spectra(
        recording,
        Prediction(predicted[:, :response_count], position),
        floors[record_index],
        record.fit | record.choose,
    )
    if spectra is None:
        return None
    model, is_position_compared = tuning.tune(fitted.deviations), spectra.residual.shape[2] > response_count
    entries = _list_possible_entries(model, recording, spectra.frequency_hz, is_position_compared)
    derivative_orders = {_DERIVATIVES.get(quantity) for quantity in recording.response.quantities}
    return rank_entries(spectra, entries, derivative_orders.pop() if len(derivative_orders) == 1 else None)


def find_state_dependences(
    measure: ErrorMeasure,
    tuning: Tuning,
    fitted: Fitted,
    cells: Sequence[MismatchCell],
    entry: EntryPoint | None,
    computed_evidence: Sequence[Evidence] = (),
) -> tuple[StateMismatch, ...]:
    """Find the states on which the residual of the recording with the largest error (`_find_worst_record`) depends:
    those of the sensor's error where a sensor is the best entry (none for a position's sensor, whose error is not
    tested), else those of the missing force. cells: mismatch map of `fitted`; no state where none exceeds the noise.
    computed_evidence: evidence of `fitted`; computed here if empty."""
    if not any(cell.beyond_noise for cell in cells):
        return ()
    record_index = _find_worst_record(cells)
    recording = measure.records[record_index].recording
    evidence = (computed_evidence or gather_evidence(measure, tuning, fitted))[record_index]
    best_entry = entry.ranking[0] if entry is not None and entry.ranking else None
    if best_entry is not None and best_entry.is_position_error:
        return ()
    if best_entry is not None and best_entry.place == "sensor":
        channels = recording.response.channels if best_entry.axis is None else (best_entry.axis,)
        return find_error_states(evidence, recording, cells, channels)
    return find_force_states(evidence, recording, cells, tuning.model.system)


def _find_worst_record(cells: Sequence[MismatchCell]) -> int:
    """Find the index of the record with the largest error beyond noise, in units of the noise, so that the order of the
    recordings does not matter. cells: with one beyond noise at least."""
    return max((cell for cell in cells if cell.beyond_noise), key=lambda cell: cell.in_noise).part


def _list_possible_entries(
    model: MechanicalModel, recording: Recording, frequency_hz: FloatArray, with_position: bool
) -> tuple[Entry, ...]:
    """List the entries at which a mismatch may enter the model: a force along an axis, forces along several axes, an
    error of a channel, or errors of several response channels. frequency_hz: (lines,). with_position: whether the
    position is compared in addition to the response."""
    transfer = compute_axis_transfer(model, recording.sample_rate_hz, frequency_hz)
    forces = np.concatenate([transfer.response, transfer.position], axis=1) if with_position else transfer.response
    axes = tuple(shorten_axis_name(channel, recording.command.channels) for channel in recording.command.channels)
    response_count, channel_count = model.outputs, forces.shape[1]
    identity = np.eye(channel_count, dtype=np.complex128)[None]
    entries = [Entry(f"a force along {axis}", "mechanism", axis, forces[:, :, [k]]) for k, axis in enumerate(axes)]
    entries += [Entry("forces along several axes", "mechanism", None, forces)] if len(axes) > 1 else []
    entries += [
        Entry(f"an error of the {name} channel", "sensor", name, identity[:, :, [k]])
        for k, name in enumerate(recording.response.channels[:response_count])
    ]
    entries += (
        [Entry("errors of several response channels", "sensor", None, identity[:, :, :response_count])]
        if response_count > 1
        else []
    )
    if with_position and recording.position is not None:
        entries += [
            Entry(
                f"an error of the position channel {name}",
                "sensor",
                name,
                identity[:, :, [response_count + k]],
                is_position_error=True,
            )
            for k, name in enumerate(recording.position.channels)
        ]
    return tuple(entries)
