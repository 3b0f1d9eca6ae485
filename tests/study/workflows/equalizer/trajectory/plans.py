"""Models, tables and plans to play them."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import Trajectory
from equalizer.tracking.lqr.padding import compute_band_error
from study.errors import StudyError
from study.store.formats.trajectory_file import read_trajectory
from study.workflows.equalizer.equalize_trajectory import EqualizePlan, equalize_trajectory

RATE_HZ, BAND_HZ = 1000.0, (5.0, 35.0)


def table(samples, rate_hz=RATE_HZ, kind="acceleration") -> Trajectory:
    unit, channels = ("N", ("fx", "fy", "fz")) if kind == "force" else ("m/s^2", ("ax", "ay", "az"))
    return Trajectory(Signal(samples, rate_hz, kind, unit, channels), 0.5)


def model_of(plant, place_m=(0.0, 0.0, 0.0), band_hz=BAND_HZ, **more) -> IdentifiedModel:
    channels = ("fx", "fy", "fz"), ("ax", "ay", "az")
    facts = {"place_m": place_m, "provenance": {"amplitude_n": 1.0}, **more}
    return IdentifiedModel(
        plant.A, plant.B, plant.C, np.zeros((3, 3)), RATE_HZ, band_hz, "N", "m/s^2", *channels, **facts
    )


def noise(plants, low_hz=5.5, high_hz=34.5, rms=1.0, seed=99) -> np.ndarray:
    rest_to_rest = np.sin(np.pi * np.arange(2000) / 2000)[:, None] ** 2
    return plants.multisine(low_hz, high_hz, seconds=2.0, rms=rms, seed=seed) * rest_to_rest


def with_models(plan: EqualizePlan, *names: str, **more) -> EqualizePlan:
    return replace(plan, models=tuple(plan.models[0].with_name(f"{name}.h5") for name in names), **more)


def played_error(plants, plan, shift) -> float:
    wanted, forces = read_trajectory(plan.trajectory).signal.samples, read_trajectory(plan.out).signal.samples
    return compute_band_error(wanted, plants.omega_like(shift).play(forces), RATE_HZ, BAND_HZ)


def refusal(plan, error=StudyError) -> StudyError:
    with pytest.raises(error) as caught:
        equalize_trajectory(plan)
    assert not plan.out.exists()
    assert caught.value.do_now
    return caught.value
