"""Swept, identified, driven: what the handle of the simulated omega.3 truly does is what was wanted.

Without friction (what that costs is the iteration's and the compensation's matter) and with an accelerometer that is
mounted straight, so that what is wanted along its axes is what is true.
"""

from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer
from equalizer.identification.state_space.identify import identify
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.model_equalizer import ModelEqualizer
from equalizer.tracking.feedforward.quality import measure_quality
from protocols.document.loading import load_protocol
from study.devices.clock import VirtualClock
from study.devices.device import DeviceInfo, DeviceSettings
from study.devices.rig import CompiledRig
from study.devices.safe import SafeDevice
from study.session.stimulus.limits import make_recording_limits
from study.session.stimulus.recording_pieces import make_pieces

RATE_HZ, LOOP = 1000.0, 10_000
LINES_HZ = np.fft.rfftfreq(LOOP, 1 / RATE_HZ)
BAND = (LINES_HZ > 4.99) & (LINES_HZ < 35.01)


def linear_omega3(hand: bool, seed: int) -> CompiledRig:
    from study.devices.simulated.compiled import advance, sense
    from study.devices.simulated.packing import compute_effective_mass_kg, make_rest_state, pack_parameters
    from study.devices.simulated.parameters import Omega3Parameters

    parameters = Omega3Parameters()
    straight = replace(parameters.accelerometer, turns_deg=(0.0, 0.0, 0.0), cross_axis=(0.0, 0.0, 0.0))
    drives = replace(parameters.drives, friction_n_m=0.0)
    parameters = replace(parameters, drives=drives, accelerometer=straight)
    packed = pack_parameters(parameters, hand, (0.0, 0.0, 0.0))
    info = DeviceInfo("linear omega.3", True, RATE_HZ, 12.0, compute_effective_mass_kg(parameters, packed))
    noise = np.array(np.random.SeedSequence(seed).generate_state(1, np.uint64), dtype=np.uint64)
    return CompiledRig(info, make_rest_state(packed, (0.0, 0.0, 0.0)), packed, noise, sense, advance)


def opened(protocol, hand, seed) -> SafeDevice:
    settings = DeviceSettings(make_recording_limits(protocol), 3.5, 0.0, 1.0, hand)
    return SafeDevice(linear_omega3(hand, seed), settings, VirtualClock())


def equalized(hand: bool, seed: int):
    """Quality over every line of 5 to 35 Hz, in true acceleration, of a model from noisy sweeps."""
    protocol = load_protocol(files("protocols").joinpath("sweep_band.toml").read_text("utf-8"), "sweep_band")
    device = opened(protocol, hand, seed)
    try:
        recordings = [
            recorded(device, piece) for piece in make_pieces(protocol, RATE_HZ) if piece.segment.role == "fit"
        ]
        equalizer = ModelEqualizer(identify(estimate_transfer(recordings)).model)
        return measure_quality(np.stack([played(device, equalizer, axis) for axis in range(3)], axis=2))
    finally:
        device.close()


def recorded(device, piece):
    """With the spring as a part of the device: the excitation is what enters it."""
    recording = device.play(piece.commands).recording
    return replace(recording, command=recording.excitation, segments=(piece.segment,))


def played(device, equalizer, axis):
    """(lines, 3): true acceleration over what was wanted along one axis, all lines at once."""
    phases = np.random.default_rng(axis).uniform(0, 2 * np.pi, len(LINES_HZ))
    wave = np.fft.irfft(BAND * np.exp(1j * phases), LOOP)
    wanted = np.zeros((LOOP, 3))
    wanted[:, axis] = 2.0 * wave / np.abs(wave).max()
    loop = equalizer.compute_loop_commands(Signal(wanted, RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az"))).samples
    rising = np.minimum(1.0, np.arange(LOOP) / 1000)[:, None]
    commands = np.concatenate([rising * loop, loop, loop])
    truth = device.play(Signal(commands, RATE_HZ, "force", "N", ("fx", "fy", "fz"))).truth.samples
    return np.fft.rfft(truth[-LOOP:], axis=0)[BAND] / np.fft.rfft(wanted[:, axis])[BAND, None]


@pytest.mark.slow
@pytest.mark.parametrize(
    "hand",
    [False, True],
    ids=["alone", "in a hand"],
)
def test_the_linear_device_is_flat_and_uncoupled(hand):
    found = equalized(hand, seed=1)
    assert found.flatness_db <= 0.1
    assert found.coupling_db <= -40.0
    assert found.axis_error_deg <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("hand", [False, True], ids=["alone", "in a hand"])
def test_flatness_and_coupling_hold_for_any_noise(hand):
    found = [equalized(hand, seed) for seed in range(2, 8)]
    flatness = sorted(each.flatness_db for each in found)
    coupling = sorted(each.coupling_db for each in found)
    print(f"flatness median {flatness[3]:.3f} worst {flatness[-1]:.3f} dB; ", end="")  # noqa: T201
    print(f"coupling median {coupling[3]:.1f} worst {coupling[-1]:.1f} dB")  # noqa: T201
    assert flatness[-1] <= 0.1
    assert coupling[-1] <= -40.0
