"""The bench is that of the labelled cases: with the known numbers it plays their recordings back to the noise."""

import json

import numpy as np
import pytest

from study.evaluation.challenge.bench import Bench, Oscillators
from study.evaluation.challenge.device import Device, simulate_motion
from study.evaluation.challenge.drive_plan import DrivePlan
from study.evaluation.challenge.effects.actuator import EFFECTS as ACTUATOR
from study.evaluation.challenge.nominal_models import retune
from study.evaluation.challenge.sensor import NOISE_MPS2
from study.evaluation.challenge.sensor_kernel import filter_first_order
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording


def bench_of(model):
    """The bare parts of a case's model: modes stand on its diagonal."""
    spring, mass = np.diag(model.stiffness)[3:], np.diag(model.mass)[3:]
    damper, direction = np.diag(model.damping)[3:], -(model.stiffness[:3, 3:] / np.diag(model.stiffness)[3:]).T
    damping = model.damping[:3, :3] - direction.T @ np.diag(damper) @ direction
    stiffness = model.stiffness[:3, :3] - direction.T @ np.diag(spring) @ direction
    modes = Oscillators(np.sqrt(spring / mass) / (2 * np.pi), mass, damper / (2 * np.sqrt(spring * mass)), direction)
    return Bench(model.mass[:3, :3], damping, stiffness, modes)


@pytest.fixture
def opened(shared):
    def case(name):
        cases = shared / "cases"
        truth = json.loads((cases / f"{name}.truth.json").read_text(encoding="utf-8"))
        model = bench_of(read_mechanical_model(cases / f"{name}.toml"))
        return read_recording(cases / f"{name}.h5"), model, truth

    return case


def misfit(device, recording):
    """In units of the noise, worst channel, where nothing is clipped."""
    acceleration, _ = simulate_motion(device, recording.command.samples)
    seen = filter_first_order(acceleration, 1.0 - np.exp(-np.pi)) @ device.sensor.orientation.T
    apart = (recording.response.samples - seen) / NOISE_MPS2
    read = np.abs(recording.response.samples) < 29.0
    return max(apart[read[:, j], j].std() for j in range(3))


@pytest.mark.slow
def test_where_nothing_is_missing_only_noise_is_left(opened):
    recording, model, _ = opened("open-00")
    plan = DrivePlan(recording.command.samples, recording.segments)
    bench, _ = retune(model, recording.response.samples, plan)
    assert misfit(Device(bench), recording) < 1.03


@pytest.mark.slow
def test_the_labelled_saturation_explains_its_case(opened):
    recording, model, (truth,) = opened("open-07")
    (effect,) = (each for each in ACTUATOR if each.name == truth["effect"])
    plan = DrivePlan(recording.command.samples, recording.segments)
    bench, _ = retune(model, recording.response.samples, plan)
    axis = "xyz".index(truth["axis"])
    assert misfit(Device(bench), recording) > 1.5
    assert misfit(effect.build(Device(bench), axis, truth["values"]), recording) < 1.1
