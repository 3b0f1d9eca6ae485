"""The rule by which the error measure for recordings and a model is selected. Called by `choose_measure`.

Free simulation, from rest by the commands alone, is the strictest test, because no measurement corrects it. It is not
suitable in these cases, which are tested in this order; the first that applies gives the measure and the reason. To
compare forces is to compare the force that the model needs along the measured motion (inverse dynamics) with the force
that entered; to use windows is to simulate short windows, each from an estimated state (multiple shooting).

* A recording of positions without a time axis, or of an imposed motion with a measured force: forces are compared.

* A plant in closed loop whose free motion does not decay soon enough (`decays_within`): its command contains the
  controller's reaction to the missing physics. Forces are compared where positions or velocities were measured; with
  accelerations only, windows are used.

* A plant that is unstable within a window, such as a levitated body or an inverted pendulum, and whose motion was
  measured: it was recorded under control, whether the data show it or not. Forces are compared.

* Any other plant whose slowest motion decays with a time constant of a third of the longest recording or more, such as
  one without restoring force (integrator): small errors persist or grow. Windows of 1 s or longer are used or, where no
  state can be estimated and motion was measured, forces are compared (`choose_measure`).

* A recording that does not begin at rest: the initial motion decays, so its beginning is left out; where that would be
  more than a quarter of the recording, windows are used.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.measured_motion import has_motion, is_free_motion, is_quasi_static
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.recorded_conditions import is_unstable_within
from analysis.diagnosis.limits import (
    LONGEST_DECAY_SHARE,
    MOST_OMITTED_SHARE,
    REST_S,
    REST_SHARE,
    SETTLED_CONSTANTS,
)
from equalizer.plant.linear_simulation import compute_poles
from equalizer.plant.mechanical_model import MechanicalModel

Measure = Literal["free simulation", "windows", "predicted force"]
WINDOW_S = 1.0
"""Shortest window (s). Chosen by hand."""
# Reasons and remarks for the user.
UNTIMED = (
    "No time is known: forces are compared as a function of the position, sample by sample; nothing that depends on "
    "speed, acceleration or frequency can be determined."
)
IN_SAMPLES = (
    "No time is known: each sample is counted as one second, so that every time, speed and frequency is per sample."
)
IMPOSED = (
    "The motion was imposed and the force measured, so the force that the model needs along the motion is compared "
    "with the measured one."
)
FREE = (
    "The motion is free, so the force per unit mass that the model needs along it is compared with the one that the "
    "measured acceleration implies."
)
CLOSED_LOOP = (
    "The command depends on the response and the model's free motion does not decay within the recording, so a "
    "simulation by the command alone would drift; the force that the model needs along the measured motion is "
    "compared with the force that was applied."
)
UNSTABLE = (
    "The model alone is unstable, so a controller must have held the device, and a simulation without the controller "
    "is meaningless; the force that the model needs along the measured motion is compared with the force that was "
    "applied."
)
CLOSED_LOOP_WINDOWS = (
    "The command depends on the response and the model's free motion does not decay within the recording; it is "
    "simulated in short windows, each from a state estimated from the measured motion."
)
DRIFTS = (
    "The model's free motion does not decay within the recording, so that small errors would persist or grow; it is "
    "simulated in short windows, each from a state estimated from the measured motion."
)
NOT_AT_REST = (
    "The recording does not begin at rest; the model is simulated in short windows, each from a state estimated from "
    "the measured motion."
)


@dataclass(frozen=True, slots=True)
class RuleChoice:
    """The error measure that the rule selects, and why."""

    measure: Measure
    reason: str
    """A sentence for the user; empty for a free simulation."""


def select_error_measure(records: Sequence[Observed], model: MechanicalModel) -> RuleChoice:
    """Select the measure by the rule in the module's docstring."""
    longest_s = max(len(record.command) / record.recording.sample_rate_hz for record in records)
    has_decaying_motion, is_motion_measured = (
        decays_within(model, longest_s),
        all(has_motion(record.recording, model) for record in records),
    )
    if is_motion_measured and any(is_quasi_static(record.recording) for record in records):
        return RuleChoice("predicted force", UNTIMED)
    if any(record.recording.meta.get("imposed") for record in records):
        return RuleChoice("predicted force", FREE if is_free_motion(records[0].recording) else IMPOSED)
    if not has_decaying_motion and any(is_in_closed_loop(record.recording) for record in records):
        return (
            RuleChoice("predicted force", CLOSED_LOOP)
            if is_motion_measured
            else RuleChoice("windows", CLOSED_LOOP_WINDOWS)
        )
    if is_motion_measured and is_unstable_within(model, WINDOW_S):
        return RuleChoice("predicted force", UNSTABLE)
    if not has_decaying_motion:
        return RuleChoice("windows", DRIFTS)
    if any(
        _begins_in_motion(record) and _compute_decay_samples(record, model) > MOST_OMITTED_SHARE * len(record.command)
        for record in records
    ):
        return RuleChoice("windows", NOT_AT_REST)
    return RuleChoice("free simulation", "")


def decays_within(model: MechanicalModel, longest_s: float) -> bool:
    """Whether all free motion of the model decays well within a recording of `longest_s` seconds: the slowest time
    constant is less than `LONGEST_DECAY_SHARE` of it."""
    return _compute_slowest_decay_rate(model) * LONGEST_DECAY_SHARE * longest_s > 1


def count_samples_to_omit(record: Observed, model: MechanicalModel) -> int:
    """Count the samples to leave out at the beginning of a record that begins in motion, until the motion has decayed;
    0 where it begins at rest, or where they would be more than `MOST_OMITTED_SHARE` of the record."""
    settling_samples = _compute_decay_samples(record, model)
    if settling_samples > MOST_OMITTED_SHARE * len(record.command) or not _begins_in_motion(record):
        return 0
    return int(np.ceil(settling_samples))


def _compute_decay_samples(record: Observed, model: MechanicalModel) -> float:
    """Compute the number of samples until the initial motion has decayed (`SETTLED_CONSTANTS` time constants); infinite
    if it never does."""
    decay_rate = _compute_slowest_decay_rate(model)
    return SETTLED_CONSTANTS / decay_rate * record.recording.sample_rate_hz if decay_rate > 0 else np.inf


def _compute_slowest_decay_rate(model: MechanicalModel) -> float:
    """Compute the decay rate of the slowest free motion, 1/s; negative where a motion grows."""
    return -float(compute_poles(model).real.max())


def _begins_in_motion(record: Observed) -> bool:
    """Whether the mean of a channel over the first `REST_S` (at least 4 samples) is away from zero and differs from the
    mean over the next `REST_S`, both relative to the whole record. An offset alone is no motion. False for fewer
    complete samples than four such blocks."""
    block_length = max(int(REST_S * record.recording.sample_rate_hz), 4)
    complete_samples = record.measured[np.isfinite(record.measured).all(axis=1)]
    if len(complete_samples) < 4 * block_length:
        return False
    means = (
        complete_samples[: len(complete_samples) // block_length * block_length]
        .reshape(-1, block_length, complete_samples.shape[1])
        .mean(axis=1)
    )
    changes = np.diff(means, axis=0)
    is_offset = np.abs(means[0]) > REST_SHARE * complete_samples.std(axis=0)
    is_changing = np.abs(changes[0]) > REST_SHARE * np.sqrt(np.mean(changes**2, axis=0))
    return bool(np.any(is_offset & is_changing))
