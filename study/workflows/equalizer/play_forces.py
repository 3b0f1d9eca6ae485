"""Plays forces on a device without a hand on the handle: spring, limits, and the accelerometer's reading."""

import math
from collections.abc import Callable
from typing import Any

from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.trajectory import FORCES
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from study.devices.device import Device, DeviceSettings, Fault, Played
from study.errors import DeviceError, StudyError
from study.session.stimulus.limits import SPRING_SLEW_N_PER_S, Limits
from study.session.views.handle_notice import BeforeMoving, free_handle_notice
from study.workflows.equalizer.playback_models import PlaybackModels
from study.workflows.equalizer.spring_not_in_model import spring_outside_model

SPRING_HZ = 3.5
"""Spring of the shipped recordings, for a model that does not state its spring."""
SPRING_ROOM_N = 1.5
"""Force that the virtual spring may add to the cap (N)."""
HAND_CAP_N = 3.0
"""Largest cap with a hand on the handle (N), as in any protocol."""


def require_device_alone(models: PlaybackModels) -> None:
    """Require a model of the device without a hand. Raises StudyError for a model that was identified with a hand on
    the handle."""
    if any("held" in model.provenance.get("hand", ()) for model in models.given):
        raise _refusal(
            "The model was recorded with a hand on the handle: its forces are right for that hand in that moment.",
            "Take a model of the device alone, and leave the handle alone.",
        )


def find_acting_spring(models: PlaybackModels) -> VirtualSpring:
    """The spring that adds to the commands and is not in the model. Raises StudyError where it is not known."""
    feedback = _feedback(models)
    acting = VirtualSpring(float(feedback.get("stiffness_n_per_m", 0.0)), float(feedback.get("damping_n_s_per_m", 0.0)))
    if not feedback:
        raise _refusal(
            "The model does not say under which spring it was recorded, so the spring's share of the forces is not "
            "known.",
            "Identify it from recordings that hapteq record made.",
        )
    return spring_outside_model(models.nearest, acting)


def _feedback(models: PlaybackModels) -> dict[str, Any]:
    found = models.nearest.provenance.get("feedback")
    return found if isinstance(found, dict) else {}


def playback_settings(cap_n: float, models: PlaybackModels) -> DeviceSettings:
    """The spring of the recordings; steps up to what forces at the upper end of the band do at the cap."""
    feedback = _feedback(models)
    steepest = 2 * math.pi * models.band_hz[1] * cap_n
    return DeviceSettings(
        limits=Limits(
            stimulus_cap_n=cap_n,
            total_cap_n=cap_n + SPRING_ROOM_N,
            slew_n_per_s=2 * steepest + SPRING_SLEW_N_PER_S,
            longest_hold_s=600.0,
            watchdog_s=0.5,
            release_s=0.05,
            feedback_cap_n=cap_n + SPRING_ROOM_N,  # without a hand, the spring may be stretched beyond its cap
        ),
        spring_frequency_hz=float(feedback.get("natural_frequency_hz", SPRING_HZ)),
        spring_damping_n_s_per_m=float(feedback.get("damping_n_s_per_m", 0.0)),
        keep_s=1.0,
        hand_on_handle=False,
        place_m=models.at.place_m,
        beyond_hand_ceiling=cap_n > HAND_CAP_N,
    )


def announce_motion(device: Device, peak_n: float, total_s: float, before_moving: BeforeMoving) -> None:
    """Notice before the first force on a real device. peak_n: the cap. total_s: duration of all plays."""
    if not device.info.simulated:
        before_moving(free_handle_notice(device.info.name, peak_n, total_s))


def play_forces(device: Device, forces: FloatArray, on_progress: Callable[[float], None]) -> Played:
    """Play forces (N, 3), N, at the device's rate. Raises DeviceError."""
    commands = Signal(forces, device.info.sample_rate_hz, FORCES.quantity, FORCES.unit, FORCES.header[1:])
    return device.play(commands, on_progress)


def read_measured_acceleration(played: Played) -> FloatArray:
    """(N, 3), m/s²: the accelerometer's rows. Raises DeviceError where they do not follow the forces."""
    health = played.health
    if played.recording is None or health.fault is not Fault.NONE:
        raise DeviceError("The device let go", f"While playing: {health.fault.value}.", "Check the device.")
    spoilt = {
        "the accelerometer clipped": health.sensor_clipped,
        "the force was limited": health.stimulus_clipped
        + health.feedback_clipped
        + health.total_clipped
        + health.slew_limited,
        "ticks were missed": health.missed_ticks,
    }
    if found := [f"{what} ({count} samples)" for what, count in spoilt.items() if count]:
        raise DeviceError(
            "A play tells nothing about its forces",
            f"In it {' and '.join(found)}: what was measured does not say what the forces do.",
            "Make the trajectory smaller, or the limits wider if they are meant to be.",
        )
    return played.recording.response.samples


def _refusal(happened: str, do_now: str) -> StudyError:
    return StudyError("Nothing was played", happened, do_now, saved="Nothing moved.")
