"""Plays forces into a simulated device, with a virtual spring, and measures what came of them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numba import njit, types

from study.devices.rig import READING_SIZE, TRUE_ACCELERATION
from study.devices.simulated.omega3 import build_omega3
from study.devices.simulated.packing import make_rest_state, pack_parameters

_VECTOR, _ROWS, _NOISE = types.float64[::1], types.float64[:, ::1], types.uint64[::1]
_SENSE = types.FunctionType(types.void(_VECTOR, _VECTOR, _NOISE, _VECTOR))
_ADVANCE = types.FunctionType(types.void(_VECTOR, _VECTOR, _VECTOR))
_RIG = types.Tuple((_VECTOR, _VECTOR, _NOISE))

CENTRE = (0.0, 0.0, 0.0)
ROOT_HALF = 0.5**0.5
TEST_DIRECTIONS = {
    "z + y": np.array([0, ROOT_HALF, ROOT_HALF]),
    "z - y": np.array([0, -ROOT_HALF, ROOT_HALF]),
}


@njit(types.void(_SENSE, _ADVANCE, _RIG, _ROWS, types.float64, _ROWS), cache=True, nogil=True)
def _loop(sense, advance, rig, forces, stiffness, readings) -> None:
    state, parameters, noise = rig
    command = np.empty(3)
    for k in range(forces.shape[0]):
        sense(state, parameters, noise, readings[k])
        for axis in range(3):
            command[axis] = forces[k, axis] - stiffness * readings[k, axis]
        advance(state, parameters, command)


@dataclass(frozen=True)
class Bench:
    spring_hz: float = 3.5

    def play(self, rig, forces, spring_hz=0.0):
        """Readings (n, READING_SIZE) under forces (n, 3), N, and a spring about the centre."""
        readings = np.empty((len(forces), READING_SIZE))
        stiffness = rig.info.effective_mass_kg * (2 * np.pi * spring_hz) ** 2
        _loop(
            rig.sense, rig.advance, (rig.state, rig.parameters, rig.noise), np.array(forces, float), stiffness, readings
        )
        return readings

    def rig_of(self, parameters, hand=False, place_m=CENTRE):
        """A device with other parameters than the shipped ones."""
        packed = pack_parameters(parameters, hand, place_m)
        return replace(build_omega3(0, hand), parameters=packed, state=make_rest_state(packed, place_m))

    def phasor(self, rig, frequency_hz, direction, amplitude_n=1.0, what=TRUE_ACCELERATION):
        """Complex response (3,) to amplitude * sin, once settled, over whole periods in at least 0.8 s."""
        settling, periods = 1000, int(np.ceil(0.8 * frequency_hz))
        count = round(1000 * periods / frequency_hz)
        time_s = np.arange(settling + count) / 1000
        wave = amplitude_n * np.sin(2 * np.pi * frequency_hz * time_s)
        rows = self.play(rig, wave[:, None] * np.asarray(direction), self.spring_hz)[settling:, what]
        turning = np.exp(-2j * np.pi * frequency_hz * time_s[settling:])
        return 2j / count * turning @ rows

    def matrix(self, frequency_hz, hand=False):
        """Response matrix (3, 3), output by input, to 1 N per axis."""
        return np.stack([self.phasor(build_omega3(0, hand), frequency_hz, axis) for axis in np.eye(3)], axis=1)

    def coupling(self, frequency_hz, direction, hand=False):
        """Response off the direction over response along it."""
        answer = self.phasor(build_omega3(0, hand), frequency_hz, direction)
        along = direction @ answer
        return float(np.linalg.norm(answer - along * direction) / abs(along))


@pytest.fixture(scope="session")
def bench():
    return Bench()


@pytest.fixture(params=sorted(TEST_DIRECTIONS))
def direction(request):
    return TEST_DIRECTIONS[request.param]
