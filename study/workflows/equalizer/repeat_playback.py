"""Iterative learning control on the device: play forces, measure the acceleration, correct the forces, play again.

Order: check the plan, open the device, announce the motion, measure the noise at rest, then play and correct until the
iteration ends or all repeats are played; the best forces are written if the plan names a file.
"""

import contextlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from analysis.wording import capitalise
from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.learning.iteration import (
    IterationSettings,
    IterationState,
    Verdict,
    estimate_rest_noise,
    start_iteration,
    update_forces,
)
from equalizer.tracking.learning.model_inverse import compensate_spring
from equalizer.tracking.lqr.padding import CAUSAL
from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Device, Fault, PlaybackResult
from study.devices.opening import needs_real_time, open_device
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.stimulus.limits import SPRING_SLEW_N_PER_S
from study.session.views.handle_notice import BeforeMoving, refuse_unannounced
from study.store.formats.repeats_file import get_repeats_path
from study.workflows.equalizer.play_forces import (
    announce_motion,
    play_forces,
    read_measured_acceleration,
)
from study.workflows.equalizer.repeat_results import RepeatPlan, RepeatResult, make_result, write_best_forces
from study.workflows.output_paths import require_new_outputs

REST_S = 2.0
"""Duration (s) without force before the first play, in which the noise of the sensor is measured (chosen)."""
RESTART_ADVICE = "Start again; a run for the same trajectory and model can continue from forces that were written."
"""What to do after an interruption or a fault."""
REFUSAL_TITLE = "Nothing was repeated"
"""Title of the errors of a plan that is refused."""

OnProgress = Callable[[int, float], None]
"""Called with the index of the play, from 0, and the share of it that is done, 0 to 1."""


def repeat_playback(
    plan: RepeatPlan, on_progress: OnProgress, before_moving: BeforeMoving = refuse_unannounced
) -> RepeatResult:
    """Play the forces, then correct them and play again, at most `plan.repeats` times; write the best to `plan.out`.

    before_moving: see `BeforeMoving`. Raises StudyError before anything moves if a person holds the handle, the rates
    differ, forces exceed the cap, or an output exists or has no folder. Raises UserInterruptError after an interruption
    (KeyboardInterrupt) and DeviceError after a fault of the device; the best forces so far, if any, are written then,
    and the error says so.
    """
    _check_plan(plan)
    clock = RealClock() if needs_real_time(plan.device) else VirtualClock()
    with contextlib.closing(open_device(plan.device, plan.settings, clock, plan.seed)) as device:
        play_results: list[PlaybackResult] = []
        states: list[IterationState] = []
        try:
            padding_s = CAUSAL.count_rows(device.info.sample_rate_hz)[1] / device.info.sample_rate_hz
            total_s = REST_S + (plan.repeats + 1) * (plan.reference.signal.duration_s + padding_s)
            announce_motion(device, plan.settings.limits.stimulus_cap_n, total_s, before_moving)
            _play_and_correct(plan, device, states, play_results, on_progress)
        except KeyboardInterrupt as interruption:
            saved_text = _save_best_forces(plan, states, play_results)
            if device.fault() is Fault.FORCE_LEFT:
                raise DeviceError(
                    "The force may still be on", Fault.FORCE_LEFT.sentence, RESTART_ADVICE, saved_text
                ) from None
            explanation = (
                f"{len(play_results)} of up to {plan.repeats + 1} plays were measured; the force was released."
            )
            raise UserInterruptError("Interrupted", explanation, RESTART_ADVICE, saved_text) from interruption
        except DeviceError as error:
            error.saved = _save_best_forces(plan, states, play_results)
            raise
        write_best_forces(plan, states[-1], interrupted=False)
        return make_result(plan, states[-1], play_results)


def _check_plan(plan: RepeatPlan) -> None:
    """Raise StudyError where a hand would be on the handle, no repeat was requested, an output exists, or its folder
    does not."""
    if plan.settings.hand_on_handle:
        raise make_not_repeated_error(
            "A person would hold the handle. Repeats learn what one hand did in one play, and play it to the next.",
            "Take the hand off the handle and open the device without one.",
        )
    if plan.repeats < 1:
        raise make_not_repeated_error(f"{plan.repeats} repeats were requested.", "Give 1 or more to --repeat.")
    if plan.out is not None:
        require_new_outputs(
            plan.out, get_repeats_path(plan.out), title=REFUSAL_TITLE, kind="results", saved="Nothing moved."
        )


def make_not_repeated_error(explanation: str, advice: str) -> StudyError:
    """Make the error for repeats that are refused before anything moves."""
    return StudyError(REFUSAL_TITLE, explanation, advice, saved="Nothing moved.")


def _play_and_correct(
    plan: RepeatPlan,
    device: Device,
    states: list[IterationState],
    play_results: list[PlaybackResult],
    on_progress: OnProgress,
) -> None:
    """Measure the noise at rest, then play and correct the forces until the iteration ends or `plan.repeats`
    corrections were played. Appends each result to `states` and `play_results` at once, so that they remain after an
    exception."""
    initial_state = _start_iteration(plan, device)
    rest_forces_n = np.zeros((round(REST_S * device.info.sample_rate_hz), 3))
    rest_acceleration = read_measured_acceleration(play_forces(device, rest_forces_n, lambda _: None))
    iteration_settings = replace(
        initial_state.settings, noise_floor=estimate_rest_noise(rest_acceleration, initial_state.settings)
    )
    states.append(replace(initial_state, settings=iteration_settings, noise_floor=iteration_settings.noise_floor))
    while states[-1].verdict is Verdict.CONTINUE and len(play_results) <= plan.repeats:
        play_index = len(play_results)
        play_result = play_forces(device, states[-1].forces, lambda share: on_progress(play_index, share))  # noqa: B023
        measured_acceleration = read_measured_acceleration(play_result)
        play_results.append(play_result)
        states.append(update_forces(states[-1], measured_acceleration))


def _start_iteration(plan: RepeatPlan, device: Device) -> IterationState:
    """Make the state before the first play: reference in the band, inverse of model and spring, limits, and the first
    forces, given or from the model. Raises StudyError where the rates differ or the forces cannot be played."""
    signal, rate_hz = plan.reference.signal, device.info.sample_rate_hz
    if signal.sample_rate_hz != rate_hz:
        raise make_not_repeated_error(
            f"The trajectory is at {signal.sample_rate_hz:g} Hz, the device runs at {rate_hz:g} Hz.",
            "Resample the trajectory to the device's rate.",
        )
    padding_rows = CAUSAL.count_rows(rate_hz)[1]
    padded_reference = np.pad(signal.samples, ((0, padding_rows), (0, 0)))
    invert = compensate_spring(plan.inverse(len(padded_reference)), plan.spring, rate_hz, plan.band_hz)
    reference_in_band, limits = filter_to_band(padded_reference, rate_hz, plan.band_hz), plan.settings.limits
    iteration_settings = IterationSettings(
        reference=reference_in_band,
        invert=invert,
        sample_rate_hz=rate_hz,
        band_hz=plan.band_hz,
        first_gain=plan.first_gain,
        cap_n=limits.stimulus_cap_n,
        slew_n_per_s=max(0.0, limits.slew_n_per_s - SPRING_SLEW_N_PER_S),
        judged_rows=(0, len(signal)),
    )
    try:
        if plan.first is None:
            return start_iteration(iteration_settings)
        if plan.first.shape != signal.samples.shape:
            raise ValueError(f"forces of shape {plan.first.shape} do not match {len(signal)} rows")
        # After the last row of the table, the model's own forces are played.
        return start_iteration(iteration_settings, np.vstack([plan.first, invert(reference_in_band)[len(signal) :]]))
    except ValueError as error:
        raise make_not_repeated_error(
            f"{capitalise(str(error))}.", "Make the trajectory smaller, or correct it."
        ) from error


def _save_best_forces(plan: RepeatPlan, states: list[IterationState], play_results: list[PlaybackResult]) -> str:
    """Write the best forces so far after an interruption or a fault, if there are any and the plan has an output.
    Returns a sentence on what was written."""
    if plan.out is None or not (states and states[-1].residuals):
        return "Nothing was written."
    write_best_forces(plan, states[-1], interrupted=True)
    return f"The best forces of {len(play_results)} plays are in {plan.out}."
