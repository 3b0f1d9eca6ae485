"""A recording as a rig (device `replay:FILE`): the handle moves as recorded, independent of the commanded force.

Before each stimulus, the stretch is searched whose recorded excitation is nearest to the stimulus (least squares over
the whole stretch), and its motion is replayed: exactly for commands that were recorded, else that of the nearest ones.
A stimulus that is repeated repeats its stretch, with a cross-fade from its end to its beginning where the recording is
longer than the stretch. Between stimuli the handle is at rest, and its sensor has noise.
"""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit, types

from analysis.psychophysics.ellipsoid import read_sensor_frame
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from study.devices.device import REPLAY_PREFIX, DeviceInfo
from study.devices.force_dimension.device_models import MODELS
from study.devices.governor.compiling import compute_fingerprint
from study.devices.rig import ACCELERATION, POSITION, READING_SIZE, SENSOR_CLIPPED, TRUE_ACCELERATION, CompiledRig
from study.errors import DeviceError, StudyError
from study.store.formats.recording_file import read_recording

MIN_REPEATED_S = 0.5
"""Smallest length (s) of a repeated stretch of several loops, rounded down to whole loops: long enough that the hand's
motion does not look periodic. Set by hand."""
CROSSFADE_S = 0.02
"""Length (s) of the cross-fade from the end of a repeated stretch to its beginning. Set by hand."""
NOMINAL_MODEL = MODELS["omega3"]
"""Model whose maximum force and mass are taken for the replayed device: a recording contains neither."""

TICK, FIRST_ROW, LENGTH, REPEATS, CROSSFADE = range(5)
"""Indices in the state: ticks since the first row (negative before), first row of the stretch, its number of rows,
whether it is repeated, and rows over which its end is cross-faded into its beginning."""

AX, TRUE_AX = ACCELERATION.start, TRUE_ACCELERATION.start
"""Indices in a reading of the x components of measured and true acceleration."""

_VECTOR = types.float64[::1]
_RANDOM_STATE = types.uint64[::1]
"""numba's types of the arguments: vectors of floats, and the state of the random generator."""


def _compile_entry_points(sources_fingerprint: int) -> tuple[Any, Any]:
    """Compile `sense` and `advance`. sources_fingerprint: captured so that a change of a source invalidates numba's
    cache. Arguments of both: state, with the indices above; parameters, with the recorded readings row by row, and last
    the half width of the noise (m/s²)."""

    @njit(types.void(_VECTOR, _VECTOR, _RANDOM_STATE, _VECTOR), cache=True, nogil=True)
    def sense(state: FloatArray, parameters: FloatArray, noise: npt.NDArray[np.uint64], reading: FloatArray) -> None:
        """Fill the reading of the tick in `state`. noise: (1,), 0 during ticks; else the state of the random generator,
        for readings while nothing is played, with the handle at rest and noise in the acceleration."""
        _ = sources_fingerprint
        first_row, stretch_rows, crossfade_rows = int(state[FIRST_ROW]), int(state[LENGTH]), int(state[CROSSFADE])
        tick = int(state[TICK])
        tick = tick % stretch_rows if state[REPEATS] != 0.0 else min(max(tick, 0), stretch_rows - 1)
        earlier_weight = (
            (tick - (stretch_rows - crossfade_rows) + 1.0) / (crossfade_rows + 1.0)
            if crossfade_rows > 0 and tick >= stretch_rows - crossfade_rows
            else 0.0
        )
        present_offset, earlier_offset = (
            READING_SIZE * (first_row + tick),
            READING_SIZE * (first_row + tick - stretch_rows),
        )
        for i in range(READING_SIZE):
            reading[i] = parameters[present_offset + i]
            if earlier_weight > 0.0 and i != SENSOR_CLIPPED:
                reading[i] = (1.0 - earlier_weight) * parameters[present_offset + i] + earlier_weight * parameters[
                    earlier_offset + i
                ]
        if noise[0] != 0:
            for i in range(3):
                noise[0] ^= noise[0] << np.uint64(13)  # Marsaglia, Xorshift RNGs, 2003
                noise[0] ^= noise[0] >> np.uint64(7)
                noise[0] ^= noise[0] << np.uint64(17)
                reading[AX + i] = parameters[-1] * (2.0 * float(noise[0]) / 2.0**64 - 1.0)
                reading[TRUE_AX + i] = 0.0

    @njit(types.void(_VECTOR, _VECTOR, _VECTOR), cache=True, nogil=True)
    def advance(state: FloatArray, parameters: FloatArray, force_n: FloatArray) -> None:
        """Advance to the next row of the recording; the force has no effect."""
        _ = sources_fingerprint
        state[TICK] += 1.0

    return sense, advance


sense, advance = _compile_entry_points(compute_fingerprint(Path(__file__).parent, Path(__file__).parents[1] / "rig.py"))


def make_replay_rig(path: Path) -> CompiledRig:
    """Make a rig that replays the recording in the file `path`. Raises `DeviceError` for a file that cannot be
    replayed."""
    try:
        recording = read_recording(path)
    except StudyError as error:
        raise _make_replay_error(f"{error.title}: {error.happened}") from error
    readings, excitation = _collect_readings(recording, path), _select_excitation(recording, path)
    rate_hz, state = recording.sample_rate_hz, np.zeros(CROSSFADE + 1)
    state[LENGTH] = len(readings)

    def prepare(rows: FloatArray, repeats: bool, wait_ticks: int) -> None:
        """Choose the stretch of the recording for the commands rows (n, 3), N; see `CompiledRig.prepare`."""
        min_rows = round(MIN_REPEATED_S * rate_hz)
        commands = np.tile(rows, (max(1, min_rows // len(rows)), 1)) if repeats else rows
        stretch_rows = min(len(commands), len(readings))
        fade_rows = min(round(CROSSFADE_S * rate_hz), stretch_rows - 1, len(readings) - stretch_rows) if repeats else 0
        # The cross-fade needs the rows before the stretch, where the end of the loop must have been played, too.
        lead_in = commands[:stretch_rows][stretch_rows - fade_rows :]
        first_row = fade_rows + _find_stretch(excitation, np.concatenate([lead_in, commands[:stretch_rows]]))
        state[[TICK, FIRST_ROW, LENGTH, REPEATS, CROSSFADE]] = -wait_ticks, first_row, stretch_rows, repeats, fade_rows

    return CompiledRig(
        info=DeviceInfo(
            name=f"replay of {recording.device or path.name}",
            simulated=True,
            sample_rate_hz=rate_hz,
            max_force_n=NOMINAL_MODEL.max_force_n,
            effective_mass_kg=NOMINAL_MODEL.effective_mass_kg,
            details=f"{path.name}, {len(readings)} samples; no force changes what is replayed",
            moved_by_force=False,
        ),
        state=state,
        parameters=np.append(readings.reshape(-1), _estimate_noise_mps2(readings[:, ACCELERATION])),
        noise=np.zeros(1, dtype=np.uint64),
        sense=sense,
        advance=advance,
        prepare=prepare,
    )


def _find_stretch(excitation: FloatArray, pattern: FloatArray) -> int:
    """Find the first row in the excitation (N, 3), N, of the stretch with the smallest sum of squared differences from
    the pattern (n, 3), n <= N; by cross-correlation with the fast Fourier transform."""
    candidate_count = len(excitation) - len(pattern) + 1
    fft_length = len(excitation) + len(pattern)
    spectrum = np.fft.rfft(excitation, fft_length, axis=0) * np.fft.rfft(pattern, fft_length, axis=0).conj()
    correlation = np.fft.irfft(spectrum, fft_length, axis=0).sum(axis=1)[:candidate_count]
    cumulative_energy = np.concatenate([[0.0], np.cumsum((excitation**2).sum(axis=1))])
    return int(np.argmin(cumulative_energy[len(pattern) :] - cumulative_energy[:candidate_count] - 2 * correlation))


def _collect_readings(recording: Recording, path: Path) -> FloatArray:
    """Collect the recorded readings (n, READING_SIZE). Missing positions, such as of missed ticks, are interpolated
    linearly, because the safety layer ends a stimulus at a reading without a position. Clipping of the sensor is not
    recorded, and is 0. Accelerations are turned into the device's axes where the recording states the sensor's frame.
    Raises `DeviceError` for a recording without a position in m or an acceleration in m/s², three channels each, and
    for a frame that is no rotation."""
    position, response = recording.position, recording.response
    if (
        position is None
        or position.samples.shape[1] != 3
        or set(position.units) != {"m"}
        or np.isnan(position.samples).all(axis=0).any()
    ):
        raise _make_replay_error(f"{path.name} has no position of a handle, three channels in metres.")
    if response.samples.shape[1] != 3 or set(response.units) != {"m/s^2"}:
        raise _make_replay_error(
            f"{path.name} has no acceleration of a handle as its response, three channels in m/s^2."
        )
    readings = np.zeros((len(recording), READING_SIZE))
    for channel, samples in enumerate(_arrange_axes(position, "").T, start=POSITION.start):
        (known_rows,) = np.nonzero(~np.isnan(samples))
        readings[:, channel] = np.interp(np.arange(len(samples)), known_rows, samples[known_rows])
    readings[:, ACCELERATION] = readings[:, TRUE_ACCELERATION] = _turn_to_device(recording, path)
    return readings


def _turn_to_device(recording: Recording, path: Path) -> FloatArray:
    """Turn the accelerations (n, 3), m/s², from the sensor's axes to the device's; a missing one is missing only on the
    axes of the device that depend on it. Raises `DeviceError` for a frame that is no rotation."""
    try:
        rotation = read_sensor_frame(recording)
    except ValueError as error:
        raise _make_replay_error(f"{path.name}: {error}.") from error
    accelerations = _arrange_axes(recording.response, "a")
    if rotation is None:
        return accelerations
    is_missing = np.isnan(accelerations)
    is_unknown = is_missing @ (rotation.T != 0.0)
    return np.where(is_unknown, np.nan, np.where(is_missing, 0.0, accelerations) @ rotation.T)


def _estimate_noise_mps2(acceleration: FloatArray) -> float:
    """Estimate the half width (m/s²) of a uniform noise with the sensor's standard deviation: sqrt(3) times it. The
    deviation is 1/0.6745 of the median absolute third difference, which removes smooth motion, over sqrt(20), by which
    differencing scales white noise. acceleration: (n, 3); 0 for fewer than four samples."""
    residual = np.diff(acceleration, n=3, axis=0) / np.sqrt(20.0)
    return float(np.sqrt(3.0) * np.nanmedian(np.abs(residual)) / 0.6745) if residual.size else 0.0


def _select_excitation(recording: Recording, path: Path) -> FloatArray:
    """Select the recorded excitation (n, 3), N; the command where none was recorded. Missing samples count as 0. Raises
    `DeviceError` for other units or numbers of channels."""
    excitation: Signal = recording.command if recording.excitation is None else recording.excitation
    if excitation.samples.shape[1] != 3 or set(excitation.units) != {"N"}:
        raise _make_replay_error(f"{path.name} has no force on a handle as its command, three channels in N.")
    return np.nan_to_num(_arrange_axes(excitation, "f"))


def _arrange_axes(signal: Signal, prefix: str) -> FloatArray:
    """Arrange the samples (n, 3) in the order x, y, z where the channels are named so, after the prefix, in another
    order; channels with other names stay in their order."""
    names = [f"{prefix}{axis}" for axis in "xyz"]
    return (
        signal.samples[:, [signal.channels.index(name) for name in names]]
        if set(signal.channels) == set(names)
        else signal.samples
    )


def _make_replay_error(reason: str) -> DeviceError:
    """Make the error for a file that cannot be replayed. reason: a sentence."""
    return DeviceError(
        "This cannot be replayed", reason, f"Give a recording of `hapteq record`, as --device {REPLAY_PREFIX}FILE.h5."
    )
