"""A recording as a rig: the handle moves as recorded, independent of the commanded force.

Before each stimulus, the stretch is searched whose recorded excitation is nearest to the stimulus (least squares over
the whole stretch), and its motion is replayed: exactly for commands that were recorded, else that of the nearest ones.
A stimulus that is repeated repeats its stretch, with a cross-fade from its end to its beginning. Between stimuli the
handle rests where it is, and its sensor has noise.
"""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit, types

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from study.devices.device import REPLAY, DeviceInfo
from study.devices.force_dimension.models import MODELS
from study.devices.governor.compiling import fingerprint
from study.devices.rig import ACCELERATION, POSITION, READING_SIZE, SENSOR_CLIPPED, TRUE_ACCELERATION, CompiledRig
from study.errors import DeviceError, StudyError
from study.store.formats.recording_file import read_recording

REPEATED_S = 0.5
"""Least length (s) of a repeated stretch, in whole loops: long enough that the hand's motion does not look periodic.
By hand."""
CROSSFADE_S = 0.02
"""Length (s) of the cross-fade from the end of a repeated stretch to its beginning. By hand."""
NOMINAL = MODELS["omega3"]
"""Model whose maximum force and mass are taken for the replayed device: a recording contains neither."""

TICK, FIRST, LENGTH, REPEATS, CROSSFADE_TICKS = range(5)
"""Indices in the state: ticks since the first row (negative before), first row of the stretch, its number of rows,
whether it is repeated, and rows over which its end is cross-faded into its beginning."""

AX, TRUE_AX = ACCELERATION.start, TRUE_ACCELERATION.start

_VECTOR = types.float64[::1]
_NOISE = types.uint64[::1]


def _entry_points(sources: int) -> tuple[Any, Any]:
    @njit(types.void(_VECTOR, _VECTOR, _NOISE, _VECTOR), cache=True, nogil=True)
    def sense(state: FloatArray, parameters: FloatArray, noise: npt.NDArray[np.uint64], reading: FloatArray) -> None:
        """Fill the reading of the tick in `state`. noise: (1,), 0 during ticks; else the state of the random generator,
        for readings while nothing is played, with the handle at rest and noise in the acceleration."""
        _ = sources
        first, length, crossfade = int(state[FIRST]), int(state[LENGTH]), int(state[CROSSFADE_TICKS])
        tick = int(state[TICK])
        tick = tick % length if state[REPEATS] != 0.0 else min(max(tick, 0), length - 1)
        share = (
            (tick - (length - crossfade) + 1.0) / (crossfade + 1.0)
            if crossfade > 0 and tick >= length - crossfade
            else 0.0
        )
        present_index, earlier_index = READING_SIZE * (first + tick), READING_SIZE * (first + tick - length)
        for i in range(READING_SIZE):
            reading[i] = parameters[present_index + i]
            if share > 0.0 and i != SENSOR_CLIPPED:
                reading[i] = (1.0 - share) * parameters[present_index + i] + share * parameters[earlier_index + i]
        if noise[0] != 0:
            for i in range(3):
                noise[0] ^= noise[0] << np.uint64(13)  # Marsaglia, Xorshift RNGs, 2003
                noise[0] ^= noise[0] >> np.uint64(7)
                noise[0] ^= noise[0] << np.uint64(17)
                reading[AX + i] = parameters[-1] * (2.0 * float(noise[0]) / 2.0**64 - 1.0)
                reading[TRUE_AX + i] = 0.0

    @njit(types.void(_VECTOR, _VECTOR, _VECTOR), cache=True, nogil=True)
    def advance(state: FloatArray, parameters: FloatArray, force_n: FloatArray) -> None:
        _ = sources
        state[TICK] += 1.0

    return sense, advance


sense, advance = _entry_points(fingerprint(Path(__file__).parent, Path(__file__).parents[1] / "rig.py"))


def make_replay_rig(path: Path) -> CompiledRig:
    """A recording as a rig. Raises `DeviceError` for a file that cannot be replayed."""
    try:
        recording = read_recording(path)
    except StudyError as problem:
        raise _replay_error(f"{problem.title}: {problem.happened}") from problem
    readings, excitation = _collect_readings(recording, path), _select_excitation(recording, path)
    rate_hz, state = recording.sample_rate_hz, np.zeros(CROSSFADE_TICKS + 1)
    state[LENGTH] = len(readings)

    def prepare(rows: FloatArray, repeats: bool, wait: int) -> None:
        longest_rows = round(REPEATED_S * rate_hz)
        commands = np.tile(rows, (max(1, longest_rows // len(rows)), 1)) if repeats else rows
        length = min(len(commands), len(readings))
        crossfade = min(round(CROSSFADE_S * rate_hz), length - 1, len(readings) - length) if repeats else 0
        # The cross-fade needs the rows before the stretch, where the end of the loop must have been played, too.
        lead_in = commands[:length][length - crossfade :]
        first = crossfade + _find_nearest(excitation, np.concatenate([lead_in, commands[:length]]))
        state[[TICK, FIRST, LENGTH, REPEATS, CROSSFADE_TICKS]] = -wait, first, length, repeats, crossfade

    return CompiledRig(
        info=DeviceInfo(
            name=f"replay of {recording.device or path.name}",
            simulated=True,
            sample_rate_hz=rate_hz,
            max_force_n=NOMINAL.max_force_n,
            effective_mass_kg=NOMINAL.effective_mass_kg,
            details=f"{path.name}, {len(readings)} samples; no force changes what is replayed",
            moved_by_force=False,
        ),
        state=state,
        parameters=np.append(readings.reshape(-1), _noise_mps2(readings[:, ACCELERATION])),
        noise=np.zeros(1, dtype=np.uint64),
        sense=sense,
        advance=advance,
        prepare=prepare,
    )


def _find_nearest(excitation: FloatArray, pattern: FloatArray) -> int:
    """Index in the excitation (N, 3) of the stretch that differs least from wanted (n, 3), n <= N."""
    rows = len(excitation) - len(pattern) + 1
    size = len(excitation) + len(pattern)
    spectrum = np.fft.rfft(excitation, size, axis=0) * np.fft.rfft(pattern, size, axis=0).conj()
    correlation = np.fft.irfft(spectrum, size, axis=0).sum(axis=1)[:rows]
    energy = np.concatenate([[0.0], np.cumsum((excitation**2).sum(axis=1))])
    return int(np.argmin(energy[len(pattern) :] - energy[:rows] - 2 * correlation))


def _collect_readings(recording: Recording, path: Path) -> FloatArray:
    """Recorded readings (n, READING_SIZE). Clipping of the sensor is not recorded, and is 0."""
    position, response = recording.position, recording.response
    if position is None or position.samples.shape[1] != 3 or set(position.units) != {"m"}:
        raise _replay_error(f"{path.name} has no position of a handle, three channels in metres.")
    if response.samples.shape[1] != 3 or set(response.units) != {"m/s^2"}:
        raise _replay_error(f"{path.name} has no acceleration of a handle as its response, three channels in m/s^2.")
    readings = np.zeros((len(recording), READING_SIZE))
    readings[:, POSITION] = position.samples
    readings[:, ACCELERATION] = readings[:, TRUE_ACCELERATION] = response.samples
    return readings


def _noise_mps2(acceleration: FloatArray) -> float:
    """Half width (m/s²) of a uniform noise as strong as the sensor's, sqrt(3) times its standard deviation: from third
    differences, which remove smooth motion and multiply the variance of white noise by 20."""
    residual = np.diff(acceleration, n=3, axis=0) / np.sqrt(20.0)
    return float(np.sqrt(3.0) * np.nanmedian(np.abs(residual)) / 0.6745) if residual.size else 0.0


def _select_excitation(recording: Recording, path: Path) -> FloatArray:
    """The recorded excitation (n, 3), N; the command where none was recorded. Missing samples count as 0."""
    decided: Signal = recording.command if recording.excitation is None else recording.excitation
    if decided.samples.shape[1] != 3 or set(decided.units) != {"N"}:
        raise _replay_error(f"{path.name} has no force on a handle as its command, three channels in N.")
    return np.nan_to_num(np.asarray(decided.samples, dtype=np.float64))


def _replay_error(reason: str) -> DeviceError:
    return DeviceError(
        "This cannot be replayed", reason, f"Give a recording of `hapteq record`, as --device {REPLAY}FILE.h5."
    )
