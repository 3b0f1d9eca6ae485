"""Playback of target accelerations on a simulated device: response from target to true acceleration (figure 5).

Figure 5 of the paper compares target and delivered accelerations with and without the equalizer. Each row of the figure
is one position of the handle, one device and one way to convert the target acceleration to forces (a driver). The three
axes are played one after the other, all at the same peak force.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.reproduction.played_response import (
    PlayedResponse,
    SignalKind,
    estimate_response,
    make_target_wave,
)
from equalizer.signals.excitation import apply_fades
from equalizer.signals.signal import FloatArray, Signal
from study.devices.clock import VirtualClock
from study.devices.device import Device, DeviceSettings
from study.devices.opening import SIMULATED, open_device
from study.errors import StudyError
from study.evaluation.reproduction.reproduction_plan import CENTRE, Place, ReproductionPlan
from study.session.stimulus.limits import make_recording_limits
from study.store.formats.protocol_files import read_recording_protocol

ACCELERATION_CHANNELS = ("ax", "ay", "az")
"""Names of the channels of a target acceleration."""
PEAK_FORCE_RATIO = 0.93
"""Peak of the norm of the force, as a fraction of the protocol's force cap. Chosen: far above friction, below the
cap."""
PLAYED_PERIODS = 2
"""Number of periods played: the transient decays in the first, and the last is measured."""
FADE_S = 0.5
"""Duration of the fade-in of the periodic forces (s). Chosen."""
WAVE_SEED = 5
"""Seed of the target acceleration, the same for all rows, so that they can be compared. Chosen."""

Driver = Callable[[Signal], FloatArray]
"""Converts one period of target accelerations (period, 3), m/s², to the forces (period, 3) that should cause it, up to
a common factor."""


@dataclass(frozen=True, slots=True)
class PlaybackRow:
    """One row of figure 5: position of the handle, device, and driver."""

    name: str
    """Label of the row in the figure and its table."""
    driver: Driver
    """Function that converts the target acceleration to forces."""
    place_m: Place = CENTRE
    """Position of the handle in the workspace: x, y, z (m)."""
    device: str = SIMULATED
    """Name of the device, as the option `--device` takes it."""
    hand: bool = False
    """Whether a simulated hand holds the handle."""
    signal: SignalKind = "sweep"
    """Kind of the target acceleration: sweep or multisine."""


def drive_without_equalizer(target: Signal) -> FloatArray:
    """Drive without an equalizer: forces (period, 3) equal to the target accelerations, up to a common factor."""
    return target.samples


def play_row(plan: ReproductionPlan, row: PlaybackRow) -> PlayedResponse:
    """Play one row on its device and measure its response. Raises DeviceError, and StudyError where the device does not
    play the forces to their end or does not report its true acceleration."""
    protocol = read_recording_protocol(plan.protocols.band).protocol
    settings = DeviceSettings(
        limits=make_recording_limits(protocol),
        spring_frequency_hz=protocol.spring.natural_frequency_hz,
        spring_damping_n_s_per_m=protocol.spring.damping_n_s_per_m,
        keep_s=1.0,  # without effect: it limits the recording of held stimuli only
        hand_on_handle=row.hand,
        place_m=row.place_m,
    )
    peak_n = PEAK_FORCE_RATIO * protocol.safety.stimulus_cap_n
    with contextlib.closing(open_device(row.device, settings, VirtualClock(), plan.seed)) as device:
        return _play_axes(plan, row, device, peak_n)


def _play_axes(plan: ReproductionPlan, row: PlaybackRow, device: Device, peak_n: float) -> PlayedResponse:
    """Measure the response from target to true acceleration, (lines, 3, 3). Each axis is played in turn; its forces are
    scaled to the peak `peak_n` (N), and the target acceleration by the same factor."""
    rate_hz = device.info.sample_rate_hz
    target_wave = make_target_wave(row.signal, plan.band_hz, round(plan.period_s * rate_hz), rate_hz, WAVE_SEED)
    targets, delivered_accelerations, total_clipped_ticks = [], [], 0
    for axis in range(3):
        samples = np.zeros((len(target_wave), 3))
        samples[:, axis] = target_wave
        period_force = row.driver(Signal(samples, rate_hz, "acceleration", "m/s^2", ACCELERATION_CHANNELS))
        scale = peak_n / float(np.linalg.norm(period_force, axis=1).max())
        true_acceleration, clipped_ticks = _play_to_steady_state(device, scale * period_force)
        targets.append(scale * target_wave)
        delivered_accelerations.append(true_acceleration)
        total_clipped_ticks += clipped_ticks
    frequency_hz, response = estimate_response(np.array(targets), delivered_accelerations, plan.band_hz, rate_hz)
    return PlayedResponse(
        name=row.name,
        device=device.info.name,
        place_m=row.place_m,
        hand=row.hand,
        signal=row.signal,
        frequency_hz=frequency_hz,
        response=response,
        peak_force_n=peak_n,
        clipped_ticks=total_clipped_ticks,
    )


def _play_to_steady_state(device: Device, period_force: FloatArray) -> tuple[FloatArray, int]:
    """Play `PLAYED_PERIODS` periods; returns the true acceleration of the handle in the last, (period, 3) in m/s², and
    the number of ticks at which a cap limited the force, summed over the three caps. period_force: (period, 3), N.
    Raises StudyError where the device does not play to the end or reports no true acceleration."""
    rate_hz = device.info.sample_rate_hz
    forces = apply_fades(np.tile(period_force, (PLAYED_PERIODS, 1)), round(FADE_S * rate_hz), 0)
    run = device.play(Signal(forces, rate_hz, "force", "N", ("fx", "fy", "fz")))
    if run.truth is None or run.recording is None:
        raise StudyError(
            "The device did not play the forces to their end",
            f"{device.info.name}: {run.health.fault.value}; its true acceleration is not known.",
            "Run the command again.",
            saved="Recordings and models so far are in the folder.",
        )
    health = run.health
    clipped_ticks = health.stimulus_clipped + health.feedback_clipped + health.total_clipped
    return run.truth.samples[-len(period_force) :], clipped_ticks
