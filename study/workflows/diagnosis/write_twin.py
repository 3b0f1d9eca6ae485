"""Identify a device's nominal mechanical model (digital twin, `hapteq twin`) from recordings made for this purpose.

Steps: record multisines at two amplitudes well above friction; fit masses, dampings, stiffnesses and modes to the
stronger recording; estimate the equivalent viscous damping of dry friction from the increase of damping at the lower
amplitude (`rigid_body`) and subtract it; add tolerances, and the linkage's inertia if a calibration is given; write the
model with its provenance.
"""

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.linalg import LinAlgError

from analysis.wording import capitalise
from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import (
    MechanicalFit,
    MechanicalFitError,
    MechanicalFitSettings,
)
from equalizer.identification.mechanical.rigid_body import RigidBody, fit_rigid_body, remove_friction_damping
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, MechanicalModelError, SensorLimits
from equalizer.signals.recording import Recording
from protocols.definition.recording_protocol import RecordingProtocol
from study.devices.opening import CALIBRATED_PREFIX, SIMULATED
from study.errors import StudyError, WrongUseError
from study.session.views.handle_notice import BeforeMoving, refuse_unannounced
from study.store.disk.provenance import gather_provenance
from study.store.formats.calibration_file import read_calibration
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.protocol_files import read_recording_protocol
from study.store.formats.recording_file import read_recording
from study.workflows.diagnosis.twin_calibration import check_same_device, describe_calibration, make_inertia_effects
from study.workflows.output_paths import require_new_outputs
from study.workflows.recording.record_device import RecordingPlan, record_device

TITLE = "The model was not made"
"""Title of the errors about output file, protocol, calibration and fit."""
STANDARD_GRAVITY_MPS2 = 9.80665
"""Standard acceleration of free fall (m/s²), exact by definition (CGPM 1901)."""
SENSOR = SensorLimits(bandwidth_hz=500.0, range=3 * STANDARD_GRAVITY_MPS2)
"""Bandwidth (Hz) and range (m/s²) of the accelerometer ADXL335, by its data sheet; the bandwidth follows from the
filter capacitors of its board."""
ACTUATOR = ActuatorLimits(bandwidth_hz=600.0)
"""Assumed bandwidth (Hz) of the motors' current loops: a typical value, not measured."""
WEAKER_AMPLITUDE_RATIO = 0.6
"""Amplitude of the second recording relative to the first. Chosen: the equivalent viscous damping of dry friction is
inversely proportional to the amplitude of motion, and true viscous damping does not depend on it."""


@dataclass(frozen=True, slots=True)
class TwinPlan:
    """Arguments of `write_twin`: model file to write, device to record, recording protocol, band, calibration."""

    out: Path
    device: str = "simulated"
    seed: int = 1
    """Seed of the simulated device's noise."""
    protocol: str = "multisine"
    """Recording protocol with multisines along x, y and z: name of a shipped protocol, or a file."""
    band_hz: tuple[float, float] = (3.0, 60.0)
    """Fitted band: the frequencies of the shipped study with a margin. Modes above it would slow down simulations."""
    calibration: Path | None = None
    """Calibration of the device's linkage, if any. The model then states how the inertia changes along each axis; the
    simulated device is given the calibration's linkage and masses."""

    @property
    def opened_device(self) -> str:
        """Name under which the device is opened."""
        as_calibrated = self.calibration is not None and self.device == SIMULATED
        return f"{CALIBRATED_PREFIX}{self.calibration}" if as_calibrated else self.device


@dataclass(frozen=True, slots=True, eq=False)
class WrittenTwin:
    """A written mechanical model of a device, and the fits from which it was made."""

    plan: TwinPlan
    model: MechanicalModel
    """The model as written."""
    fit: MechanicalFit
    rigid_body: RigidBody
    """The fit as a rigid body at low frequencies, with the damping that is due to friction."""
    notes: tuple[str, ...]
    """Sentences on assumptions, on the effect of friction, on the fit and, if there is one, on the calibration."""


def write_twin(
    plan: TwinPlan,
    on_progress: Callable[[float], None],
    before_moving: BeforeMoving = refuse_unannounced,
) -> WrittenTwin:
    """Record, fit and write the model. on_progress: called with the fraction done, 0 to 1. before_moving: as for
    `record_device`. Raises StudyError, and then writes no model."""
    check_output_and_band(plan)
    calibration = None if plan.calibration is None else read_calibration(plan.calibration)
    protocol = read_recording_protocol(plan.protocol).protocol
    _require_three_axes(plan, protocol)
    with tempfile.TemporaryDirectory() as folder:
        recording_plans = [
            RecordingPlan(level, plan.opened_device, (0.0, 0.0, 0.0), plan.seed, Path(folder) / f"{name}.h5")
            for name, level in (("strong", protocol), ("weaker", _reduce_amplitudes(protocol)))
        ]
        # Shares of the progress, chosen: 0.15 for each recording, 0.6 for the fits, the rest for writing.
        stronger = _record_and_read(recording_plans[0], lambda share: on_progress(0.15 * share), before_moving)
        if calibration is not None and plan.opened_device == plan.device:
            check_same_device(calibration, stronger.device, TITLE)
        weaker = _record_and_read(recording_plans[1], lambda share: on_progress(0.15 + 0.15 * share), before_moving)
    fit, rigid_body = _fit_models(plan, stronger, weaker, lambda share: on_progress(0.3 + 0.6 * share))
    frictionless_model = remove_friction_damping(fit.model, rigid_body.friction_damping)
    model = replace(
        frictionless_model,
        name=f"{stronger.device}, as identified",
        effects=() if calibration is None else make_inertia_effects(frictionless_model, calibration),
        tolerance=rigid_body.tolerance,
        provenance=_gather_model_provenance(plan, protocol, stronger, fit),
    )
    write_mechanical_model(plan.out, model)
    on_progress(1.0)
    notes = _describe_assumptions(stronger, fit, rigid_body)
    if calibration is not None:
        notes += describe_calibration(model, rigid_body.mass, calibration)
    return WrittenTwin(plan, model, fit, rigid_body, notes)


def _fit_models(
    plan: TwinPlan, stronger: Recording, weaker: Recording, on_progress: Callable[[float], None]
) -> tuple[MechanicalFit, RigidBody]:
    """Fit the model over the whole band, and a rigid body to both recordings. Raises StudyError where a fit is
    refused."""
    settings = MechanicalFitSettings(
        band_hz=plan.band_hz, sensor=SENSOR, actuator=ACTUATOR, joint=True, fit_delay=False
    )
    try:
        fit = fit_mechanical_model([stronger], settings, on_progress, plan.device)
        return fit, fit_rigid_body(fit, stronger, weaker, settings)
    except (MechanicalFitError, MechanicalModelError, LinAlgError) as refusal:
        raise StudyError(
            TITLE,
            f"{capitalise(str(refusal))}.",
            "Record more strongly or for longer, or choose another band with --band.",
            saved="Nothing was written.",
        ) from refusal


def check_output_and_band(plan: TwinPlan) -> None:
    """Check the output path and the band, before anything moves. Raises StudyError where the output exists or its
    folder does not, WrongUseError for a band that does not rise from above 0 Hz."""
    require_new_outputs(plan.out, title=TITLE, kind="models", saved="Nothing moved and nothing was written.")
    low_hz, high_hz = plan.band_hz
    if not (math.isfinite(low_hz) and math.isfinite(high_hz) and 0 < low_hz < high_hz):
        raise WrongUseError(
            "There is no such band",
            f"--band is {low_hz:g} to {high_hz:g} Hz; it must rise, from above zero.",
            "Correct --band.",
            saved="Nothing moved and nothing was written.",
        )


def _require_three_axes(plan: TwinPlan, protocol: RecordingProtocol) -> None:
    """Raise WrongUseError unless multisines drive x, y and z, which the masses and their coupling require."""
    driven_directions = {segment.along for segment in protocol.segments if segment.kind == "multisine"}
    if not {"x", "y", "z"} <= driven_directions and "all" not in driven_directions:
        raise WrongUseError(
            TITLE,
            f"The protocol {plan.protocol} does not play multisines along x, y and z, so that masses and coupling "
            "cannot be identified.",
            "Choose the protocol multisine, or one like it.",
            saved="Nothing moved and nothing was written.",
        )


def _reduce_amplitudes(protocol: RecordingProtocol) -> RecordingProtocol:
    """Multiply all amplitudes of the protocol by `WEAKER_AMPLITUDE_RATIO`."""
    weaker_segments = tuple(
        replace(segment, amplitude_n=WEAKER_AMPLITUDE_RATIO * segment.amplitude_n) for segment in protocol.segments
    )
    return replace(protocol, segments=weaker_segments)


def _record_and_read(
    plan: RecordingPlan, on_progress: Callable[[float], None], before_moving: BeforeMoving
) -> Recording:
    """Record by the plan and read the recording back, with the roles of `_assign_test_roles`. on_progress: called with
    the fraction done, 0 to 1."""
    total_s = max(plan.total_s, 1e-9)  # not 0, which would be divided by
    record_device(plan, lambda seconds: on_progress(min(seconds / total_s, 1.0)), before_moving)
    return _assign_test_roles(read_recording(plan.out))


def _assign_test_roles(recording: Recording) -> Recording:
    """Set the role of the last multisine realisation along each direction to "test", if there are several; else
    "fit"."""
    segment_metadata: list[Mapping[str, Any]] = recording.meta["segments"]
    last_realisations: dict[str, int] = {}
    for metadata in segment_metadata:
        last_realisations[metadata["along"]] = max(
            last_realisations.get(metadata["along"], 0), metadata["realisation"] or 0
        )
    segments = tuple(
        replace(segment, role="test" if 1 < last_realisations[metadata["along"]] == metadata["realisation"] else "fit")
        for segment, metadata in zip(recording.segments, segment_metadata, strict=True)
    )
    return replace(recording, segments=segments)


def _gather_model_provenance(
    plan: TwinPlan, protocol: RecordingProtocol, stronger: Recording, fit: MechanicalFit
) -> dict[str, Any]:
    """Gather the origin of the model: software, seed, device, protocol, band and quality of the fit."""
    parents = () if plan.calibration is None else (plan.calibration,)
    return {
        **gather_provenance(seeds={"device": plan.seed}, parents=parents).as_dict(),
        "device": plan.device,
        "protocol": protocol.name,
        "from": "command, the virtual spring's force in it",
        "to": "acceleration at the handle",
        "band_hz": list(fit.band_hz),
        "sensor": "data sheet",
        "actuator": "assumed",
        "held_out_error": fit.held_out,
        "noise": fit.noise,
        "feedback": stronger.meta.get("feedback"),
        "reason": fit.reason,
    }


def _describe_assumptions(stronger: Recording, fit: MechanicalFit, rigid_body: RigidBody) -> tuple[str, ...]:
    """Describe the assumptions of the model, the damping that was subtracted and the reason of the fit, as sentences
    for the user."""
    feedback = stronger.meta.get("feedback") or {}
    stiffness_n_per_m = float(feedback.get("stiffness_n_per_m", 0.0))
    return (
        f"The model is from the whole command to the acceleration: the virtual spring of {stiffness_n_per_m:.0f} N/m "
        "pushed as a part of the command, so it is not in the model's stiffness.",
        "The sensor's bandwidth and range are those of its data sheet; for the current loops "
        f"{ACTUATOR.bandwidth_hz:g} Hz are assumed.",
        "Cables lie between drives and handle. Force and acceleration do not determine how the mass is divided "
        "between the two sides of a cable: half on each side is assumed.",
        "Dry friction is no part of a linear model: it appears as additional damping, which decreases as the force "
        f"increases. From the change when the force was lowered to {WEAKER_AMPLITUDE_RATIO:.0%}, "
        f"{', '.join(f'{damping:.3g}' for damping in rigid_body.friction_damping)} N s/m were attributed to friction "
        "and subtracted.",
        fit.reason,
    )
