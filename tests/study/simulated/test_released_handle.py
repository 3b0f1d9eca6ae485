"""What the response to a stimulus tells of the grip, on the simulated omega.3: why a release is no stop."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from protocols.definition.apparatus import TestDirections
from study.devices.clock import VirtualClock
from study.devices.safe import SafeDevice
from study.devices.simulated.omega3 import build_omega3
from study.devices.simulated.packing import pack_parameters
from study.devices.simulated.parameters import Hand, Omega3Parameters
from study.session.stimulus.delivered import MAX_HAND_MASS_KG, has_too_little_motion, measure_delivered
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.stimulus import compute_direction_vector
from study.store.formats.protocol_files import read_study_protocol
from study.workflows.device_settings import make_device_settings

PROTOCOL = read_study_protocol("direction_threshold").protocol
VECTOR = compute_direction_vector(TestDirections(), 1)
LEVEL_N = 1.0
FRICTION_N = PROTOCOL.safety.plausibility.friction_n
DEVICE_KG = build_omega3(1, hand=True).info.effective_mass_kg


def gripped(share: float) -> FloatArray:
    """Parameters with so much of the simulated hand; 0: let go."""
    hand = Hand(*(tuple(share * part for part in parts) for parts in vars_of(Hand())))
    return pack_parameters(Omega3Parameters(hand=hand), share > 0, (0.0, 0.0, 0.0))


def vars_of(hand: Hand) -> tuple[tuple[float, ...], ...]:
    return hand.mass_kg, hand.damping_n_s_per_m, hand.stiffness_n_per_m


def recorded(frequency_hz: float, grips: tuple[float, float], seed: int, level_n: float) -> Recording:
    """The last of a held stimulus, when the grip changes from the first to the second in the middle of it."""
    rig = replace(build_omega3(seed, hand=True), parameters=gripped(grips[0]))
    wave = level_n * np.sin(2 * np.pi * frequency_hz * np.arange(200) / 1000)[:, None] * VECTOR
    loop = Signal(wave, 1000.0, "force", "N", ("fx", "fy", "fz"))
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(rig, make_device_settings(PROTOCOL), clock)) as device:
        device.hold(HeldStimulus(loop, 0.5, 0.05, "raised_cosine"))
        for tenth in range(30):
            if tenth == 15:
                rig.parameters[:] = gripped(grips[1])
            clock.sleep(0.1)
            device.keep_alive()
        recording = device.release().recording
    assert recording is not None
    return recording


def rise_db(frequency_hz: float, before: float, after: float, seed: int, gain: float = 1.0) -> float:
    """Of the acceleration in the last second of a held stimulus, when the grip changes in the middle of it. gain: of
    the motors after the change, as if from the beginning."""
    found = []
    for grip, given in ((before, 1.0), (after, gain)):
        delivered = measure_delivered(
            recorded(frequency_hz, (before, grip), seed, given * LEVEL_N), VECTOR, frequency_hz
        )
        assert delivered is not None
        found.append(delivered.along_mps2)
    return float(20 * np.log10(found[1] / found[0]))


@pytest.mark.parametrize("seed", [1])
def test_a_released_grip_is_seen_in_the_response_and_so_is_one_that_only_became_lighter(seed):
    released = {frequency: rise_db(frequency, 1.0, 0.0, seed) for frequency in (5.0, 25.0, 45.0)}
    assert all(rise > 1.5 for rise in released.values())
    lighter = {frequency: rise_db(frequency, 1.0, 0.25, seed) for frequency in released}
    light_released = {frequency: rise_db(frequency, 0.25, 0.0, seed) for frequency in released}
    # No threshold on the change names the release alone.
    assert all(lighter[frequency] > light_released[frequency] > 0.3 for frequency in released)


@pytest.mark.parametrize("grip", [0.0, 1.0, 20.0])
@pytest.mark.parametrize("frequency_hz", [5.0, 10.0, 25.0, 45.0])
def test_no_grip_is_taken_for_motors_that_do_nothing(frequency_hz, grip):
    """Not even one that is twenty times as firm."""
    for level_n, told in ((0.6, False), (3.0, True)):
        recording = recorded(frequency_hz, (grip, grip), 1, level_n)
        assert not has_too_little_motion(recording, VECTOR, frequency_hz, FRICTION_N, DEVICE_KG)
        response = recording.response
        still = replace(recording, response=replace(response, samples=0.02 * response.samples))
        assert has_too_little_motion(still, VECTOR, frequency_hz, FRICTION_N, DEVICE_KG) is told


def moved(mass_kg: float, frequency_hz: float) -> Recording:
    """A free mass under a sine of 3 N, after 1 s at 1 kHz."""
    wave = 3.0 * np.sin(2 * np.pi * frequency_hz * np.arange(1000) / 1000)[:, None] * VECTOR
    return Recording(
        device="a free mass",
        command=Signal(wave, 1000.0, "force", "N", ("fx", "fy", "fz")),
        response=Signal(wave / mass_kg, 1000.0, "acceleration", "m/s^2", ("ax", "ay", "az")),
    )


@pytest.mark.parametrize("device_kg", [0.1, 1.0, 4.0])
def test_a_heavy_device_in_the_heaviest_hand_is_not_taken_for_motors_that_do_nothing(device_kg):
    """At 45 Hz, where mass opposes most: only what moves less than hand and declared mass together is told."""
    heavy = moved(MAX_HAND_MASS_KG + device_kg, 45.0)
    assert not has_too_little_motion(heavy, VECTOR, 45.0, FRICTION_N, device_kg)
    assert has_too_little_motion(moved(2 * (MAX_HAND_MASS_KG + device_kg), 45.0), VECTOR, 45.0, FRICTION_N, device_kg)


def test_motors_that_give_30_percent_less_look_like_a_firmer_grip():
    """Why no limit on what trials delivered watches the motors: it would stop firm grips, or miss this."""
    for frequency_hz in (25.0, 35.0, 45.0):
        weaker = rise_db(frequency_hz, 1.0, 1.0, 1, gain=0.7)
        assert -3.2 < weaker < -2.6
        assert rise_db(frequency_hz, 1.0, 3.0, 1) < weaker < rise_db(frequency_hz, 1.0, 1.5, 1)
        # From a light grip to a firm one, it changes by more.
        assert rise_db(frequency_hz, 0.5, 2.0, 1) < weaker
