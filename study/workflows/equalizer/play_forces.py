"""Play computed forces on a device without a hand on the handle, and read the acceleration that they made.

Used where a trajectory is repeated or learned on the device, and where a controller plays against it: the settings of
the device (spring and safety limits), the notice before the first motion, one play, and the check that its measured
acceleration may be used.
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
from study.session.views.handle_notice import BeforeMoving, free_handle_notice
from study.workflows.equalizer.playback_models import PlaybackModels
from study.workflows.equalizer.spring_not_in_model import spring_outside_model

DEFAULT_SPRING_HZ = 3.5
"""Natural frequency (Hz) of the centring spring in the shipped recording protocols, for a model that does not state its
spring."""
SPRING_ROOM_N = 1.5
"""Force (N) that the centring spring may add to the cap of the commanded forces."""
LONGEST_HOLD_S = 600.0
"""Limit (s) of a held stimulus, the largest allowed (`admission.HIGHEST`): a play has an end of its own."""
WATCHDOG_S = 0.5
"""Time (s) without a sign of life from this program after which the device lets go."""
RELEASE_S = 0.05
"""Duration (s) of the fade when the device lets go, the default of `[safety]` in a protocol."""


def require_device_alone(models: PlaybackModels) -> None:
    """Raise StudyError for a model that was identified with a hand on the handle: it does not hold for the free
    handle."""
    if any("held" in model.provenance.get("hand", ()) for model in models.all_models):
        raise _refusal(
            "The model was recorded with a hand on the handle: its forces are valid only for that hand at that moment.",
            "Take a model of the device alone, and leave the handle alone.",
        )


def find_acting_spring(models: PlaybackModels) -> VirtualSpring:
    """The spring that adds to the commands and is not in the model. Raises StudyError where it is not known."""
    feedback = _feedback(models)
    spring = VirtualSpring(float(feedback.get("stiffness_n_per_m", 0.0)), float(feedback.get("damping_n_s_per_m", 0.0)))
    if not feedback:
        raise _refusal(
            "The model does not say under which spring it was recorded, so the spring's share of the forces is not "
            "known.",
            "Identify it from recordings that hapteq record made.",
        )
    return spring_outside_model(models.nearest, spring)


def _feedback(models: PlaybackModels) -> dict[str, Any]:
    """Spring of the recordings of the nearest model, from its provenance; empty where it states none."""
    feedback = models.nearest.provenance.get("feedback")
    return feedback if isinstance(feedback, dict) else {}


def playback_settings(cap_n: float, models: PlaybackModels) -> DeviceSettings:
    """Settings of the device: the spring of the model's recordings, and limits for forces with a peak of `cap_n` (N).

    The slew limit allows twice the steepest slope of a sine at the cap and the upper end of the band, because a sum of
    sines and learned corrections are steeper than one sine, and adds that of the spring.
    """
    feedback = _feedback(models)
    steepest_n_per_s = 2 * math.pi * models.band_hz[1] * cap_n
    return DeviceSettings(
        limits=Limits(
            stimulus_cap_n=cap_n,
            total_cap_n=cap_n + SPRING_ROOM_N,
            slew_n_per_s=2 * steepest_n_per_s + SPRING_SLEW_N_PER_S,
            longest_hold_s=LONGEST_HOLD_S,
            watchdog_s=WATCHDOG_S,
            release_s=RELEASE_S,
            # Without a hand the handle moves further than in a trial, which stretches the spring more.
            feedback_cap_n=cap_n + SPRING_ROOM_N,
        ),
        spring_frequency_hz=float(feedback.get("natural_frequency_hz", DEFAULT_SPRING_HZ)),
        spring_damping_n_s_per_m=float(feedback.get("damping_n_s_per_m", 0.0)),
        keep_s=1.0,
        hand_on_handle=False,
        place_m=models.at.place_m,
        beyond_hand_ceiling=cap_n > HAND_STIMULUS_CAP_N,
    )


def announce_motion(device: Device, peak_n: float, total_s: float, before_moving: BeforeMoving) -> None:
    """Ask for the free handle before the first force on a real device; nothing for a simulated one. peak_n: cap of the
    forces. total_s: duration of all plays."""
    if not device.info.simulated:
        before_moving(free_handle_notice(device.info.name, peak_n, total_s))


def play_forces(device: Device, forces: FloatArray, on_progress: Callable[[float], None]) -> PlaybackResult:
    """Play forces, (samples, 3) in N at the device's rate. on_progress: takes the share played, 0 to 1. Raises
    DeviceError."""
    commands = Signal(forces, device.info.sample_rate_hz, FORCES.quantity, FORCES.unit, FORCES.header[1:])
    return device.play(commands, on_progress)


def read_measured_acceleration(play: PlaybackResult) -> FloatArray:
    """(samples, 3), m/s²: what the accelerometer read. Raises DeviceError where it cannot be taken for the effect of
    the forces: a fault ended the play, a reading clipped, a force was limited, or ticks were missed."""
    health = play.health
    if play.recording is None or health.fault is not Fault.NONE:
        raise DeviceError("The device let go", f"While playing: {health.fault.value}.", "Check the device.")
    sample_counts = {
        "the accelerometer clipped": health.sensor_clipped,
        "the force was limited": health.stimulus_clipped
        + health.feedback_clipped
        + health.total_clipped
        + health.slew_limited,
        "ticks were missed": health.missed_ticks,
    }
    if problems := [f"{problem} ({count} samples)" for problem, count in sample_counts.items() if count]:
        raise DeviceError(
            "The measured acceleration is not that of the forces",
            f"While playing, {' and '.join(problems)}.",
            "Make the trajectory smaller, or the limits wider if they are meant to be.",
        )
    return play.recording.response.samples


def _refusal(explanation: str, advice: str) -> StudyError:
    return StudyError("Nothing was played", explanation, advice, saved="Nothing moved.")
