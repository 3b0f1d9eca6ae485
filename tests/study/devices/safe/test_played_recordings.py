"""The safe device as its callers use it: what is played, and the recordings of it."""

from dataclasses import replace

import numpy as np
import pytest

from study.devices.clock import VirtualClock
from study.devices.device import Fault
from study.devices.safe import SafeDevice
from tests.study.devices.safe.feeling import feel


def test_the_steady_part_is_kept_in_whole_loops_of_what_was_played(device, clock, rigs):
    device.hold(rigs.sine(2.0, periods_per_s=5, fade_s=0.1))
    feel(device, clock, 1.0)
    played = device.release()
    recording = played.recording
    assert len(recording) == 400  # two loops of 200 in the 500 that may be kept
    shift = (1000 - 400) % 200
    assert np.allclose(recording.excitation.samples[shift:200], rigs.sine(2.0).loop.samples[: 200 - shift])
    segment = recording.segments[0]
    assert (segment.start, segment.stop, segment.kind, segment.period) == (0, 400, "sine", 200)
    assert segment.amplitude == pytest.approx(2.0)
    assert played.health.fault is Fault.NONE


@pytest.fixture
def springless(rigs, rig, clock):
    device = SafeDevice(rig, replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0), clock)
    yield device
    device.close()


def test_an_onset_is_played_once_as_it_is_and_the_loop_follows(springless, clock, rigs, rig):
    loop = rigs.sine(2.0, periods_per_s=5)
    onset = rigs.force(np.linspace(0.0, 1.0, 150)[:, None] * [0.0, 0.0, 1.0])
    springless.hold(replace(loop, onset=onset))
    feel(springless, clock, 0.5)
    played = springless.release()
    commands = np.concatenate([onset.samples, loop.loop.samples, loop.loop.samples])[:500]
    assert np.allclose(rigs.written(rig)[:500], commands)
    assert len(played.recording) == 200  # one loop of 200 in the 350 that followed the onset
    assert played.recording.segments[0].period == 200


def test_a_release_within_an_onset_fades_it_out(springless, clock, rigs, rig):
    springless.hold(replace(rigs.sine(2.0), onset=rigs.force(np.full((400, 3), [0.0, 0.0, 0.01]))))
    feel(springless, clock, 0.2)
    assert springless.release().recording is None
    written = rigs.written(rig)
    assert np.allclose(written[:200, 2], 0.01) and (np.diff(written[200:, 2]) <= 0).all() and written[-1, 2] == 0.0


def test_command_is_what_the_rig_got_and_readings_were_taken_just_before(device, clock, rigs, rig):
    device.hold(rigs.sine(2.0))
    feel(device, clock, 1.0)
    played = device.release()
    command = played.recording.command.samples
    start = next(k for k in range(2000) if (rigs.written(rig)[k : k + 400] == command).all())
    assert start == 600
    assert np.allclose(np.diff(command - played.recording.excitation.samples, axis=0), 0, atol=0.1)
    velocity = np.diff(played.recording.position.samples, axis=0) * 1000
    predicted = (command[:-1][1:] - 2.0 * velocity[:-1]) / rigs.MASS_KG
    assert np.allclose(played.truth.samples[2:], predicted, atol=1e-6)
    assert (played.truth.samples == played.recording.response.samples).all()


def test_a_loop_longer_than_what_is_kept_leaves_its_last_part(device, clock, rigs):
    device.hold(rigs.sine(1.0, periods_per_s=1))
    feel(device, clock, 1.0)
    assert len(device.release().recording) == 500


def test_a_stimulus_that_never_became_steady_has_no_recording(device, clock, rigs):
    device.hold(rigs.sine(1.0, fade_s=0.3))
    feel(device, clock, 0.4)
    played = device.release()
    assert played.recording is None
    assert played.health.fault is Fault.NONE


def test_release_waits_until_the_force_is_off(device, clock, rigs, rig):
    device.hold(rigs.sine(2.0, fade_s=0.1))
    feel(device, clock, 0.5)
    before_s = clock.now_s()
    device.release()
    assert 0.1 <= clock.now_s() - before_s < 0.12
    assert not rigs.written(rig)[-1].any()


def test_while_nothing_is_held_nothing_is_simulated(device, clock, rigs, rig):
    clock.sleep(100.0)
    assert len(rigs.written(rig)) == 0


def test_compiled_and_stepped_rigs_are_driven_bit_for_bit_alike(rigs):
    results = []
    for rig in (rigs.compiled_rig(), rigs.ScriptedRig()):
        clock = VirtualClock()
        device = SafeDevice(rig, rigs.SETTINGS, clock)
        device.hold(rigs.sine(2.5, 25))
        feel(device, clock, 0.8)
        first = device.release().recording
        second = device.play(rigs.force(np.tile(rigs.sine(1.0).loop.samples, (3, 1)))).recording
        device.close()
        bare = rig if hasattr(rig, "state") else rig.mass
        results.append((first, second, rigs.written(bare)))
    (first, second, forces), (other_first, other_second, other_forces) = results
    assert (forces == other_forces[: len(forces)]).all()
    for each, other in ((first, other_first), (second, other_second)):
        for name in ("command", "response", "position", "excitation"):
            assert (getattr(each, name).samples == getattr(other, name).samples).all()


def test_recordings_do_not_depend_on_how_sleep_is_divided(rigs):
    results = []
    for nap in (0.001, 0.0173, 0.25):
        clock, rig = VirtualClock(), rigs.compiled_rig()
        device = SafeDevice(rig, rigs.SETTINGS, clock)
        device.hold(rigs.sine(2.0))
        while clock.now_s() + nap < 1.0:
            clock.sleep(nap)
            device.keep_alive()
        clock.sleep(1.0 - clock.now_s())
        results.append(rigs.written(rig)[:1000])
        device.close()
    assert (results[0] == results[1]).all()
    assert (results[0] == results[2]).all()


def test_play_records_every_sample_of_what_was_asked(device, rigs):
    commands = rigs.force(np.tile(rigs.sine(2.0).loop.samples, (5, 1)))
    shares = []
    played = device.play(commands, shares.append)
    assert len(played.recording) == 1000
    assert np.allclose(played.recording.excitation.samples, commands.samples, atol=1e-12)
    assert played.recording.segments == ()
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0


def test_a_recording_may_be_longer_than_the_longest_trial_and_the_watchdog(device, rigs):
    commands = rigs.force(np.zeros((25_000, 3)))
    assert len(device.play(commands).recording) == 25_000


def test_the_spring_is_settled_when_a_recording_begins(device, rigs, rig):
    rig.parameters[1] = 20.0
    rig.state[0] = 0.01
    recording = device.play(rigs.force(np.zeros((100, 3)))).recording
    assert abs(recording.command.samples).max() < 0.3
    assert np.linalg.norm(rigs.written(rig), axis=1).max() > 0.5
