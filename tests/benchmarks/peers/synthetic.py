"""The data of the benchmark, one for all: the synthetic device with a known truth, its sweeps, its sensor's noise."""

import time
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import numpy as np
import plants
from exchange import Data
from run_hapteq import recording_of

from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer
from equalizer.identification.state_space.settings import IdentificationSettings

PERIODS = 2
REST_S = 1.5


@dataclass(frozen=True)
class Experiment:
    """Sweeps of 1 N along each axis in turn, two periods of 30 s each, in one continuous record from rest to rest."""

    sweep_hz: tuple[float, float]
    band_hz: tuple[float, float] = (5.0, 35.0)
    order: int = 26
    seconds: float = 30.0

    @cached_property
    def command(self) -> np.ndarray:
        wave = np.tile(plants.sweep(*self.sweep_hz, self.seconds), PERIODS)
        rest = np.zeros((round(REST_S * plants.RATE_HZ), 3))
        return np.vstack([*(wave[:, None] * axis for axis in np.eye(3)), rest])

    @cached_property
    def truth(self) -> np.ndarray:
        return plants.omega_like().play(self.command)

    def data(self, seed: int) -> Data:
        noise = np.random.default_rng(seed).standard_normal(self.truth.shape) * plants.SENSOR_RMS
        period = round(self.seconds * plants.RATE_HZ)
        starts = np.arange(3) * PERIODS * period
        nothing, response = np.empty(0), self.truth + noise
        told = (plants.RATE_HZ, self.command, response, starts, starts + PERIODS * period, period)
        bare = Data(*told, nothing, nothing, nothing, 0.0, self.band_hz, self.order)
        began_s = time.process_time()
        lines = estimate_transfer([recording_of(bare)])
        cpu_s = time.process_time() - began_s
        lines = lines.select_lines(lines.reliable).select_band(
            *IdentificationSettings(self.band_hz, self.order).fitted_hz
        )
        estimate = (lines.frequency_hz, lines.response, np.sqrt(lines.noise_variance), cpu_s)
        return Data(*told, *estimate, self.band_hz, self.order)


def write_data(data: Data, path: Path) -> None:
    np.savez(path, **{field.name: getattr(data, field.name) for field in fields(data)})
