"""Fit the first mechanical model, from which a diagnosis starts where the user gave no model.

Methods, in the order in which they are tried: a spring per axis by force balance, for quasi-static recordings without
time; the coefficients of the force balances, where these name laws along the motion of one body per command; damper and
spring per unit mass by force balance, for a free motion; rigid bodies fitted to forces, for recordings in closed loop
or of an imposed motion (`fit_rigid_model`); a mechanical model fitted to frequency responses (`mechanical_fit`), which
takes longest, or rigid bodies where that fails. Tolerances are wide, because unmodelled physics may bias the fitted
parameters.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.balances import find_balances
from analysis.diagnosis.balance.laws.law import measure_scales
from analysis.diagnosis.balance.linear_part import assign_channels, compute_errors_without_channel
from analysis.diagnosis.balance.motion import NoMotionError, compute_motions
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.data.measured_motion import fill_gaps, is_free_motion, is_quasi_static
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.data.recorded_conditions import has_payload
from analysis.diagnosis.first_model.first_model import FirstModel
from analysis.diagnosis.first_model.model_from_balance import build_plain_model
from analysis.diagnosis.first_model.model_structures import (
    FIXED_SHARE,
    Kind,
    StructureFitError,
    balance_recordings,
    fit_structure,
)
from analysis.diagnosis.forces.rigid_model import can_be_rigid, fit_rigid_model, should_use_rigid_model
from analysis.diagnosis.limits import LEAST_MODEL_RESPONSE
from analysis.diagnosis.types import Mapper, Progress, TimeBudget
from analysis.wording import conjoin, format_sentence
from equalizer.effects.simulation.simulator import simulate_response
from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitError, MechanicalFitSettings
from equalizer.identification.mechanical.widened_tolerance import widen_tolerance
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording

RIGID_REMARK = (
    "No model was given. One body per axis, with damping and, where that shows, a spring, was fitted first to the "
    "forces along the measured motion; its damping may change by a quarter, because it may include friction."
)
BALANCE_REMARK = (
    "No model was given. One body per axis, with damping and a spring, was fitted first to the forces along the "
    "measured motion; its parameters may change by a tenth, and by half of what the named laws change in them."
)
UNTIMED_REMARK = (
    "No model was given, and no time is known: a spring per axis was fitted first to the forces along the positions. "
    "The mass in the file is a lower bound that the forces do not determine; damping and mass are not known."
)

FREE_REMARK = (
    "No model was given. A damper per axis, and a spring where one can be fitted, were fitted first to the force per "
    "unit mass that the free motion shows; the mass in the file is 1, because a free motion does not determine it."
)
FIT_OUT_OF_TIME = (
    "The time limit was reached while the linear model was fitted: a model with more modes may fit better. A later "
    "limit, or --model with a model of `hapteq model`, avoids this."
)
"""Remarks of a diagnosis on its first model, by the method of the fit, and on a fit that the time limit ended."""

EXCHANGED_ERROR_RATIO = 2.0
"""Ratio of the squared errors of a force balance without the other and without the own channel from which these are
said to be exchanged. Chosen: of simulated recordings, exchanged axes had at least 2.4 even with as much noise as
motion, noise alone and coupled axes at most 1.25."""


def fit_first_model(
    recordings: Sequence[Recording],
    excluded_effects: Collection[str],
    time_left: TimeBudget,
    on_progress: Progress,
    map_: Mapper = map,
) -> FirstModel:
    """Fit the first model: by force balance where that is possible, else by `fit_first_linear_model`, which takes
    longer. recordings: at least one, as converted by `one_motion_per_force`. excluded_effects: names of effects that
    the balance must not name. time_left: time limit of the balance and the fit. on_progress: called with a text and the
    completed fraction, 0 to 1, of which the balance counts as the first half. map_: a possibly parallel `map`. Raises
    NothingToDiagnoseError where no model can be fitted, or a recording was made with a weight."""
    _require_no_weight(recordings)
    on_progress("testing laws in the force balance", 0.0)
    balances = find_balances(recordings, frozenset(excluded_effects), time_left, map_)
    is_free = is_free_motion(recordings[0])
    if (
        not is_free
        and any(map(is_quasi_static, recordings))
        and (static_model := _fit_structure_by_balance(recordings, "massless")) is not None
    ):
        return FirstModel(static_model, (UNTIMED_REMARK,), balances)
    model = build_plain_model(balances, recordings[0], "fitted to these recordings")
    if is_free and (free_model := model or _fit_free_model(recordings)) is not None:
        return FirstModel(_fix_mass(free_model), (FREE_REMARK,), balances)
    if model is not None:
        return FirstModel(model, (BALANCE_REMARK,), balances)
    on_progress("fitting a linear model, as none was given", 0.5)
    model, remarks = fit_first_linear_model(
        recordings,
        lambda fraction: on_progress("fitting a linear model, as none was given", 0.5 + fraction / 2),
        time_left=time_left,
    )
    return FirstModel(model, remarks, balances)


def _fix_mass(model: MechanicalModel) -> MechanicalModel:
    """Reduce the mass tolerance of a model to `FIXED_SHARE` of the largest mass, so that re-tuning hardly changes the
    mass. model: with a tolerance."""
    assert model.tolerance is not None
    return replace(model, tolerance=replace(model.tolerance, mass_kg=FIXED_SHARE * float(np.abs(model.mass).max())))


def _fit_free_model(recordings: Sequence[Recording]) -> MechanicalModel | None:
    """Fit damper and spring per unit mass to a free motion, or a damper alone where that fit fails; None where both
    fail."""
    return _fit_structure_by_balance(recordings, "mass-spring") or _fit_structure_by_balance(recordings, "motor")


def _fit_structure_by_balance(recordings: Sequence[Recording], kind: Kind) -> MechanicalModel | None:
    """Fit the model of a structure by force balance; None where not every command has one measured position or
    velocity, or where the fit fails."""
    try:
        return fit_structure(balance_recordings(recordings), kind).model
    except (StructureFitError, NoMotionError):
        return None


def fit_first_linear_model(
    recordings: Sequence[Recording],
    on_progress: Callable[[float], None],
    source: str = "these recordings",
    time_left: TimeBudget = lambda: True,
) -> tuple[MechanicalModel, tuple[str, ...]]:
    """Fit a linear model to forces (`fit_rigid_model`) or to frequency responses. Returns the model and remarks, as
    sentences. on_progress: called with the completed fraction, 0 to 1. source: description of the recordings, for the
    remarks. time_left: where it returns False, the fit ends with the best structure so far. Raises
    NothingToDiagnoseError where no model can be fitted, or a recording was made with a weight."""
    _require_no_weight(recordings)
    settings = MechanicalFitSettings(
        band_hz=_find_stated_band(recordings), grounded=not _turn_freely(recordings), time_left=time_left
    )
    if should_use_rigid_model(recordings) and (rigid_model := _try_rigid_model(recordings, source)) is not None:
        return rigid_model, (RIGID_REMARK,)
    try:
        fit = fit_mechanical_model(recordings, settings, on_progress, f"fitted to {source}")
        if not any(_responds_to_commands(fit.model, recording) for recording in recordings):
            raise MechanicalFitError("the model that fits best hardly responds to the commands")
    except (MechanicalFitError, MechanicalModelError, np.linalg.LinAlgError) as refusal:
        if (rigid_model := _try_rigid_model(recordings, source)) is not None:
            return rigid_model, (RIGID_REMARK,)
        problems = (f"no model was given, and none can be fitted: {refusal}", *_describe_exchanged_channels(recordings))
        raise NothingToDiagnoseError(problems) from refusal
    held_out_text = "" if fit.held_out is None else f" and of {100 * fit.held_out:.1f} % on held-out data"
    first_remark = (
        f"No model was given. A linear model was fitted to {source} first, with an error of {100 * fit.error:.1f} "
        f"%{held_out_text}, and its masses, dampers and springs may change by much more than that. Physics that its "
        "parameters can represent, such as friction at one level as damping, is part of this model and is therefore "
        "not named."
    )
    return widen_tolerance(fit.model), (
        first_remark,
        *(() if time_left() else (FIT_OUT_OF_TIME,)),
        *(format_sentence(remark) for remark in fit.remarks),
    )


def _describe_exchanged_channels(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Describe, in a sentence, which response moves with which command where this is not the one of the same index;
    empty where it is, where the force balance needs both about equally (noise, coupled axes or equal commands), and
    where the numbers of moving channels and commands differ."""
    commands = recordings[0].command.channels
    try:
        motions = compute_motions(observe_parts(recordings, len(recordings[0].response.channels)))
        if len(motions[0].channels) != len(commands):
            return ()
        exchanged = [(axis, channel) for axis, channel in enumerate(assign_channels(motions)) if channel != axis]
        for axis, channel in exchanged:
            errors = compute_errors_without_channel(motions, axis, len(commands))
            if errors[channel] < EXCHANGED_ERROR_RATIO * errors[axis]:
                return ()
    except (NoMotionError, np.linalg.LinAlgError):
        return ()
    pairs = [f"{motions[0].channels[channel]} moves with {commands[axis]}" for axis, channel in exchanged]
    return (f"{conjoin(pairs)}: state the responses in the order of the commands that move them",) if pairs else ()


def _find_stated_band(recordings: Sequence[Recording]) -> tuple[float, float] | None:
    """Find the band in Hz that all recordings state as usable (`meta`, key "band_hz"), as the noise of an accelerometer
    hides the response at low frequencies; None where none states one. Raises NothingToDiagnoseError where a value is
    not two rising frequencies, or the bands have no common part."""
    bands = [band for recording in recordings if (band := recording.meta.get("band_hz")) is not None]
    for band in bands:
        is_pair = isinstance(band, Sequence) and len(band) == 2
        if not is_pair or not all(isinstance(end, int | float) for end in band) or not 0 <= band[0] < band[1]:
            raise NothingToDiagnoseError(
                (f"band_hz of a recording is {band!r}; state two frequencies in Hz, the lower one first",)
            )
    if not bands:
        return None
    low_hz, high_hz = max(float(band[0]) for band in bands), min(float(band[1]) for band in bands)
    if not low_hz < high_hz:
        raise NothingToDiagnoseError(
            (f"the bands that the recordings state ({bands}) have no common part; diagnose them separately",)
        )
    return low_hz, high_hz


def _turn_freely(recordings: Sequence[Recording]) -> bool:
    """Whether every measured shaft turns freely, so that no spring holds it (`Scales.turns_freely`); False where no
    motion can be computed."""
    try:
        motions = compute_motions(observe_parts(recordings, len(recordings[0].response.channels)))
    except NoMotionError:
        return False
    channels, is_rotational = range(len(motions[0].channels)), recordings[0].is_rotational
    return all(measure_scales(motions, channel, is_rotational).turns_freely for channel in channels)


def _responds_to_commands(model: MechanicalModel, recording: Recording) -> bool:
    """Whether the commands move the model: whether on some channel the simulated standard deviation is at least
    `LEAST_MODEL_RESPONSE` of the measured one. For an axis that friction keeps at rest, the fitted masses and springs
    grow without bound, and the simulated response is almost zero."""
    simulation = simulate_response(
        model, fill_gaps(recording.command.samples), recording.sample_rate_hz, (), recording.hold
    )
    measured_deviations = np.nanstd(recording.response.samples, axis=0)
    return bool((np.std(simulation.response, axis=0) >= LEAST_MODEL_RESPONSE * measured_deviations).any())


def _require_no_weight(recordings: Sequence[Recording]) -> None:
    """Raise NothingToDiagnoseError where the device carried a weight, whose mass a fitted model would include."""
    if has_payload(recordings):
        raise NothingToDiagnoseError(
            (
                "a recording was made with a weight on the handle, and a model that is fitted to it would include "
                "the weight; give a calibrated model, or recordings without the weight",
            )
        )


def _try_rigid_model(recordings: Sequence[Recording], source: str) -> MechanicalModel | None:
    """Fit a rigid body per command; None where the recordings do not permit that (`can_be_rigid`), or the fit fails."""
    if not can_be_rigid(recordings):
        return None
    try:
        return fit_rigid_model(recordings, f"fitted to {source}")
    except (MechanicalModelError, np.linalg.LinAlgError):
        return None
