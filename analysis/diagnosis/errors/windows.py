"""Error measure by windows (multiple shooting): short simulations, each from an initial state estimated by a smoother.

For plants whose free motion decays slowly or not at all, so that a free simulation would drift, and for recordings that
do not begin at rest. The estimated state is not exact, so that the residuals of each window are projected on the
complement of its free motions from other initial states (least squares): only the error that no initial state explains
counts (Bock and Plitt, IFAC World Congress 1984: multiple shooting). Built by `choose_measure`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.diagnosis.data.motion_smoother import SmoothedMotion, smooth_motion
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.recorded_conditions import add_payload, apply_conditions
from analysis.diagnosis.errors.error_measure_rule import WINDOW_S
from analysis.diagnosis.errors.evidence_from_residuals import gather_evidence
from analysis.diagnosis.errors.free_simulation import stack_simulated_channels
from equalizer.effects.effect import Effect, PlacedEffect, Structure
from equalizer.effects.simulation.bodies import Restarts, build_bodies
from equalizer.effects.simulation.forces_along_motion import compute_actuator_force
from equalizer.effects.simulation.sensor_path import apply_low_pass
from equalizer.effects.simulation.simulator import Measurement, SimulationResult, simulate_windows
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

_LEAST_SINGULAR_SHARE = 1e-9
"""Singular value of the free motions, over the largest, above which a direction of the state is fitted; the rest are
rounding errors. Chosen."""
READINGS_PER_STATE = 10.0
"""Least readings of all channels in a window, per fitted state: the fit then absorbs at most a tenth of the power of
random errors. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """`ErrorMeasure` by windows, each simulated from a fitted initial state. Sizes: n samples or coordinates, c
    channels."""

    records: tuple[Observed, ...]
    states: tuple[FloatArray, ...]
    """Per record (windows, 2 n), n coordinates: initial state of each window, positions before velocities."""
    unit: FloatArray
    """(c,): unit of a residual, in each channel's own unit."""
    noise: FloatArray
    """(c,): rms noise, in each channel's own unit."""
    window_s: float = WINDOW_S
    """Length of a window (s)."""
    model_effects: tuple[PlacedEffect, ...] = ()
    """Effects named in the model's own file, which are part of every simulation."""
    least_error: float = 0.0
    """Lower limit of an error in units of the noise; 0, or 1 after `with_floor`."""

    @property
    def name(self) -> str:
        """Name with the length of a window, as in `diagnosis.json`."""
        return f"windows of {self.window_s:g} s"

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """Return the measure on other records, which must match `states` in number and length."""
        return replace(self, records=records)

    def with_floor(self, rms: FloatArray) -> Self:
        """Return the measure with noise of this rms (c,) added in power, and 1 as its least error."""
        return replace(self, unit=np.hypot(self.unit, rms), noise=np.hypot(self.noise, rms), least_error=1.0)

    def shorten(self) -> "Windows":
        """Return the measure without the samples after the last one to fit or to choose by; records without such
        samples are left out."""
        used_records = [
            (record.shorten(), states)
            for record, states in zip(self.records, self.states, strict=True)
            if (record.fit | record.choose).any()
        ]
        return replace(
            self,
            records=tuple(record for record, _ in used_records),
            states=tuple(states for _, states in used_records),
        )

    def can_observe(self, effect: Effect) -> bool:
        """Whether the effect changes the compared signals: taken as true of every effect."""
        return True

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Compute, per record, (n, c): measured minus simulated, in units of `unit`, after the fit of each window's
        initial state; NaN where a sample is missing."""
        all_effects = (*self.model_effects, *effects)
        return tuple(
            self._simulate_from_states(model, all_effects, *record_and_states)[1]
            for record_and_states in zip(self.records, self.states, strict=True)
        )

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Gather, per record, the motion and missing force from which starting values are estimated. residuals: not
        used."""
        return tuple(
            self._gather_evidence(model, (*self.model_effects, *effects), record, states)
            for record, states in zip(self.records, self.states, strict=True)
        )

    def _simulate_from_states(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], record: Observed, states: FloatArray
    ) -> tuple[SimulationResult, FloatArray]:
        """Simulate all windows from their initial states (windows, 2 n). Returns the simulation, and its residuals (n,
        c) after the fit of the initial states; without that fit where the simulation diverged."""
        recording, p = record.recording, model.outputs
        model = add_payload(model, recording)
        position = record.measured[:, p:] if record.measured.shape[1] == 2 * p else None
        window_samples = count_window_samples(self.window_s, recording.sample_rate_hz)
        simulated = simulate_windows(
            model,
            record.command,
            (recording.sample_rate_hz, recording.hold),
            apply_conditions(effects, recording),
            Measurement(record.measured[:, :p], self.noise[:p], position, len(record.recording)),
            Restarts(window_samples * np.arange(len(states)), states),
        )
        with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
            residual = (record.measured - stack_simulated_channels(simulated, record.measured.shape[1])) / self.unit
        structure = build_bodies(
            model, [effect for effect in effects if isinstance(effect.effect.action, Structure)]
        ).structure
        if not (np.isfinite(residual) | np.isnan(record.measured)).all():  # the simulation diverged
            return simulated, residual
        return simulated, self._remove_state_errors(structure, residual, recording.sample_rate_hz, window_samples)

    def _remove_state_errors(
        self, structure: MechanicalModel, residual: FloatArray, sample_rate_hz: float, window_samples: int
    ) -> FloatArray:
        """Compute (n, c): residuals, NaN where missing, without their projection on the free motions from other initial
        states, window by window; unchanged where a free motion diverges, and in windows with too few readings
        (`_project_out`)."""
        n, c = residual.shape
        # A fit may try an unstable model, whose free motion overflows: its residuals are returned unchanged.
        with np.errstate(over="ignore", invalid="ignore"):
            free_motion = (
                _compute_free_motion(structure, sample_rate_hz, min(window_samples, n), c) / self.unit[:, None]
            )
            if not np.isfinite(np.sum(free_motion**2)):
                return residual
        full_windows_end = n // window_samples * window_samples
        projected = residual.copy()
        if full_windows_end:
            projected[:full_windows_end] = _project_out(
                residual[:full_windows_end].reshape(-1, window_samples * c), free_motion.reshape(window_samples * c, -1)
            ).reshape(-1, c)
        if n > full_windows_end:
            projected[full_windows_end:] = _project_out(
                residual[full_windows_end:].reshape(1, -1),
                free_motion[: n - full_windows_end].reshape((n - full_windows_end) * c, -1),
            ).reshape(-1, c)
        return projected

    def _gather_evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], record: Observed, states: FloatArray
    ) -> Evidence:
        """Gather the evidence of one record: motion and missing force are estimated by the smoother, driven by the
        actuators' forces and the effects' forces on the axes."""
        simulated, residual = self._simulate_from_states(model, effects, record, states)
        recording = record.recording
        model = add_payload(model, recording)
        actuator_forces = compute_actuator_force(
            model, record.command, recording.sample_rate_hz, effects, recording.hold
        )
        motion = smooth_motion(model, record, actuator_forces + simulated.axis_force, self.unit)
        axis_motion = motion.axis_position, motion.axis_velocity, motion.missing_force
        return gather_evidence(model, record, simulated, residual * self.unit, self.noise, axis_motion)


def build_windows(
    records: tuple[Observed, ...], model: MechanicalModel, scales: tuple[FloatArray, FloatArray], window_s: float = 1.0
) -> Windows:
    """Build the measure, with each window's initial state estimated by a smoother. records: at least one. scales: unit
    and noise, (c,) each. window_s: shortest window (s), lengthened to `READINGS_PER_STATE` at the first record's rate.
    Raises numpy.linalg.LinAlgError where the motion cannot be estimated."""
    unit, noise = scales
    states_per_channel = 2 * len(model.mass) / records[0].measured.shape[1]
    window_s = max(window_s, READINGS_PER_STATE * states_per_channel / records[0].recording.sample_rate_hz)
    initial_states = []
    for record in records:
        rate_hz = record.recording.sample_rate_hz
        actuator_forces = compute_actuator_force(model, record.command, rate_hz, (), record.recording.hold)
        motion: SmoothedMotion = smooth_motion(add_payload(model, record.recording), record, actuator_forces, unit)
        initial_states.append(motion.states[:: count_window_samples(window_s, rate_hz)])
    return Windows(records, tuple(initial_states), unit, noise, window_s)


def count_window_samples(window_s: float, sample_rate_hz: float) -> int:
    """Compute the length of a window in samples, rounded, at least 1."""
    return max(round(window_s * sample_rate_hz), 1)


def _compute_free_motion(
    structure: MechanicalModel, sample_rate_hz: float, window_samples: int, channel_count: int
) -> FloatArray:
    """Compute the free response of the channels to each unit initial state, (window_samples, c, 2 n), in the channels'
    units. structure: linear model with n coordinates."""
    discrete_model = discretise_model(structure, 1 / sample_rate_hz)
    states = np.empty((window_samples, *discrete_model.transition.shape))
    states[0] = np.eye(len(discrete_model.transition))
    for k in range(1, window_samples):
        states[k] = discrete_model.transition @ states[k - 1]
    filtered_response = apply_low_pass(
        states.transpose(0, 2, 1) @ discrete_model.response.T, sample_rate_hz, structure.sensor.bandwidth_hz
    )
    outputs = np.concatenate([filtered_response, states.transpose(0, 2, 1) @ discrete_model.position.T], axis=2)
    return np.asarray(outputs[:, :, :channel_count].transpose(0, 2, 1))


def _project_out(residual: FloatArray, free_motion: FloatArray) -> FloatArray:
    """Subtract from residuals (windows, samples), NaN where missing, their least-squares projection on the columns of
    free_motion (samples, k). A window is fitted to the samples that it has, and stays unchanged where those are fewer
    than `READINGS_PER_STATE` per column."""
    projected = residual.copy()
    patterns, pattern_index = np.unique(np.isfinite(residual), axis=0, return_inverse=True)
    for index, is_known in enumerate(patterns):  # windows with the same samples share a decomposition
        if np.count_nonzero(is_known) >= READINGS_PER_STATE * free_motion.shape[1]:
            place = np.ix_(pattern_index.ravel() == index, is_known)
            projected[place] = _project_complete_windows(residual[place], free_motion[is_known])
    return projected


def _project_complete_windows(residual: FloatArray, free_motion: FloatArray) -> FloatArray:
    """Do the same as `_project_out` for residuals without missing samples. The columns of free_motion are normalised
    first; a column of zeros has no effect."""
    column_norms = np.linalg.norm(free_motion, axis=0)
    basis, singular_values, _ = np.linalg.svd(
        free_motion / np.where(column_norms > 0, column_norms, 1.0), full_matrices=False
    )
    basis = basis[:, singular_values > _LEAST_SINGULAR_SHARE * max(float(singular_values[0]), np.finfo(float).tiny)]
    return np.asarray(residual - (residual @ basis) @ basis.T)
