"""Play computed forces on a device without a hand on the handle, and read the acceleration that they caused.

Settings of the device (spring and safety limits), the notice before the first motion, the playback, and the check that
the measured acceleration may be used.
"""

import math
from collections.abc import Callable
from typing import Any

from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.trajectory import FORCES
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from study.devices.device import Device, DeviceSettings, Fault, PlaybackResult
from study.devices.opening import HAND_STIMULUS_CAP_N
from study.errors import DeviceError, StudyError
from study.session.stimulus.limits import SPRING_SLEW_N_PER_S, Limits
from study.session.views.handle_notice import BeforeMoving, format_free_handle_notice
from study.workflows.equalizer.playback_models import PlaybackModels
from study.workflows.equalizer.spring_to_compensate import find_spring_to_compensate, read_spring

DEFAULT_SPRING_HZ = 3.5
"""Natural frequency (Hz) of the centring spring in the shipped recording protocols, for a model that does not state
that of its spring."""
SPRING_RESERVE_N = 1.5
"""Force (N) that the centring spring may add to the cap of the commanded forces. Chosen."""
LONGEST_HOLD_S = 600.0
"""Longest duration (s) of a stimulus: the largest value that is accepted (`admission.MAX_SETTINGS`), because computed
forces are of finite length."""
WATCHDOG_S = 0.5
"""Time (s) without a keep-alive call from this program after which the force is faded out. Chosen."""
FORCE_RELEASE_S = 0.05
"""Duration (s) of that fade-out, the default of `[safety]` in a protocol."""


def require_device_alone(models: PlaybackModels) -> None:
    """Raise StudyError where any model was identified with a hand on the handle: it is not valid for the free
    handle."""
    if any("held" in model.provenance.get("hand", ()) for model in models.all_models):
        raise _make_refusal(
            "The model was recorded with a hand on the handle: its forces are valid only for that hand at that moment.",
            "Take a model of the device alone, and leave the handle alone.",
        )


def find_acting_spring(models: PlaybackModels) -> VirtualSpring:
    """Find the virtual spring that acts in addition to the commanded forces and is not part of the nearest model.
    Raises StudyError where that model does not state its spring."""
    feedback = _read_recorded_spring(models)
    spring = VirtualSpring(float(feedback.get("stiffness_n_per_m", 0.0)), float(feedback.get("damping_n_s_per_m", 0.0)))
    if not feedback:
        raise _make_refusal(
            "The model does not say under which spring it was recorded, so the spring's share of the forces is not "
            "known.",
            "Identify it from recordings that hapteq record made.",
        )
    return find_spring_to_compensate(models.nearest, spring)


def _read_recorded_spring(models: PlaybackModels) -> dict[str, Any]:
    """Read the parameters of the virtual spring under which the nearest model was recorded, from its provenance:
    stiffness_n_per_m, damping_n_s_per_m, natural_frequency_hz. Empty where it states none."""
    return read_spring(models.nearest.provenance.get("feedback"))


def make_playback_settings(cap_n: float, models: PlaybackModels) -> DeviceSettings:
    """Make the settings of the device for forces with a peak of `cap_n` (N): the spring under which the model was
    recorded, and the safety limits.

    The slew limit (N/s) is twice the largest slope, 2 pi f cap_n, of a sine at the upper end f of the band, because
    sums of sines and learned corrections are steeper than one sine; the slew of the spring is added.
    """
    feedback = _read_recorded_spring(models)
    max_slope_n_per_s = 2 * math.pi * models.band_hz[1] * cap_n
    return DeviceSettings(
        limits=Limits(
            stimulus_cap_n=cap_n,
            total_cap_n=cap_n + SPRING_RESERVE_N,
            slew_n_per_s=2 * max_slope_n_per_s + SPRING_SLEW_N_PER_S,
            longest_hold_s=LONGEST_HOLD_S,
            watchdog_s=WATCHDOG_S,
            release_s=FORCE_RELEASE_S,
            # Without a hand the handle moves further than in a trial, which stretches the spring more.
            feedback_cap_n=cap_n + SPRING_RESERVE_N,
        ),
        spring_frequency_hz=float(feedback.get("natural_frequency_hz", DEFAULT_SPRING_HZ)),
        spring_damping_n_s_per_m=float(feedback.get("damping_n_s_per_m", 0.0)),
        keep_s=1.0,  # without effect: it limits the recording of held stimuli only
        hand_on_handle=False,
        place_m=models.at_place.place_m,
        beyond_hand_ceiling=cap_n > HAND_STIMULUS_CAP_N,
    )


def announce_motion(device: Device, peak_n: float, total_s: float, before_moving: BeforeMoving) -> None:
    """Call `before_moving` with the notice to leave the handle free, before the first force on a real device; does
    nothing for a simulated one. peak_n: cap of the forces (N). total_s: duration of all playbacks (s)."""
    if not device.info.simulated:
        before_moving(format_free_handle_notice(device.info.name, peak_n, total_s))


def play_forces(device: Device, forces: FloatArray, on_progress: Callable[[float], None]) -> PlaybackResult:
    """Play forces of shape (samples, 3) in N at the device's sample rate. on_progress: called with the fraction played,
    0 to 1. Raises DeviceError."""
    commands = Signal(forces, device.info.sample_rate_hz, FORCES.quantity, FORCES.unit, FORCES.header[1:])
    return device.play(commands, on_progress)


def read_measured_acceleration(play_result: PlaybackResult) -> FloatArray:
    """Read the measured acceleration, (samples, 3) in m/s². Raises DeviceError where it is not the response to the
    forces: a fault ended the playback, the accelerometer clipped, a force was limited, or ticks of the control loop
    were missed."""
    health = play_result.health
    if play_result.recording is None or health.fault is not Fault.NONE:
        raise DeviceError("The device let go", f"While playing: {health.fault.value}.", "Check the device.")
    counts_by_problem = {
        "the accelerometer clipped": health.sensor_clipped,
        "the force was limited": health.stimulus_clipped
        + health.feedback_clipped
        + health.total_clipped
        + health.slew_limited,
        "ticks were missed": health.missed_ticks,
    }
    if problems := [f"{problem} ({count} samples)" for problem, count in counts_by_problem.items() if count]:
        raise DeviceError(
            "The measured acceleration is not that of the forces",
            f"While playing, {' and '.join(problems)}.",
            "Make the trajectory smaller, or the limits wider if they are meant to be.",
        )
    return play_result.recording.response.samples


def _make_refusal(explanation: str, advice: str) -> StudyError:
    """Make the error for a playback that is not started, because the forces would not be valid."""
    return StudyError("Nothing was played", explanation, advice, saved="Nothing moved.")
