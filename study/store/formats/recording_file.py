"""Recordings as HDF5 files: read into SI units with all checks, written atomically.

`recording_layout` defines the format. Helpers that read a part of the file raise ValueError with the problem;
`read_recording` collects these, so that the user sees all of them at once, and checks the consistency of the recording
where there are none.
"""

import json
from dataclasses import astuple
from pathlib import Path
from typing import Any, Literal

import h5py
import numpy as np

from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.recording_checks import check_recording, collect_signals
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.units import check_quantity, parse_unit
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.hdf5_attributes import (
    collapse_single_text,
    read_numbers_attribute,
    read_text_attribute,
    read_texts_attribute,
    write_texts,
)
from study.store.disk.hdf5_file import ProblemCollector, open_hdf5, read_float_dataset, write_hdf5
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import replace_invalid_bytes
from study.store.formats.recording_layout import FORMAT, KIND, SEGMENT_FIELDS, VERSION

_SEGMENT_TYPE = np.dtype(
    [
        ("start", "<i8"), ("stop", "<i8"), ("kind", h5py.string_dtype()),
        ("amplitude", "<f8"), ("period", "<i8"), ("role", h5py.string_dtype()),
    ]
)  # fmt: skip
"""NumPy type of a row of the dataset `segments`; fields as in `SEGMENT_FIELDS`."""

_COMPRESS_ABOVE_BYTES = 2**18
"""Size (bytes) above which signals are compressed. Chosen by hand: smaller arrays, of which a session has thousands,
are written faster without compression."""


def read_recording(path: Path | str) -> Recording:
    """Read a recording in SI units. Raises CannotReadError where the file cannot be opened, UnusableFileError where it
    is no valid recording, with all problems of reading or, without any, of consistency."""
    path = Path(path)
    with open_hdf5(path, KIND, FORMAT, VERSION) as file:
        problems = ProblemCollector()
        rate_hz = problems.attempt(lambda: _read_rate(file), 1.0)

        def read_signal(name: str) -> Signal | None:
            """Read a signal; None after a problem, which is collected."""
            return problems.attempt(lambda: _read_signal(file, name, rate_hz), None)

        command, response = read_signal("command"), read_signal("response")
        position, excitation, condition = (
            read_signal(name) if name in file else None for name in ("position", "excitation", "condition")
        )
        device = problems.attempt(lambda: read_text_attribute(file, "device"), "")
        hold = problems.attempt(
            lambda: _parse_hold(read_text_attribute(file, "hold", Hold.ZERO_ORDER.value)), Hold.ZERO_ORDER
        )
        segments: tuple[Segment, ...] = problems.attempt(lambda: _read_segments(file), ())
        time_s = problems.attempt(lambda: _read_time_s(file), None)
        meta: dict[str, Any] = problems.attempt(lambda: _read_meta(file), {})
    if problems.messages or command is None or response is None:
        raise UnusableFileError(path, KIND, tuple(problems.messages))
    recording = Recording(device, command, response, position, excitation, time_s, hold, segments, meta, condition)
    if inconsistencies := check_recording(recording):
        raise UnusableFileError(path, KIND, inconsistencies)
    return recording


def write_recording(
    path: Path | str,
    recording: Recording,
    *,
    precision: Literal["float32", "float64"] = "float64",
    overwrite: bool = False,
) -> None:
    """Write a recording. `precision` applies to all signals but the position, which is always float64, to resolve
    micrometres in a large workspace. Raises AlreadyExistsError where the file exists and `overwrite` is False,
    CannotWriteError where it cannot be written, ValueError for an inconsistent recording or NaN in the metadata."""
    if inconsistencies := check_recording(recording):
        raise ValueError(f"this recording cannot be written: {'; '.join(inconsistencies)}")

    def write_contents(file: Any) -> None:
        """Write attributes, signals, time, segments and metadata into the open file."""
        file.attrs.update(
            {"format": FORMAT, "version": VERSION, "sample_rate_hz": recording.sample_rate_hz,
             "device": recording.device, "hold": recording.hold.value}
        )  # fmt: skip
        for name, signal in collect_signals(recording).items():
            _write_signal(file, name, signal, "float64" if name == "position" else precision)
        if recording.time_s is not None:
            file.create_dataset("time_s", data=np.asarray(recording.time_s, dtype=np.float64), fletcher32=True)
        rows = np.array([astuple(segment) for segment in recording.segments], dtype=_SEGMENT_TYPE)
        file.create_dataset("segments", data=rows)
        meta = file.create_group("meta")
        for key, value in recording.meta.items():
            # The name of an imported file may hold bytes that are no text, which JSON cannot be read with.
            meta.attrs[key] = replace_invalid_bytes(json.dumps(value, allow_nan=False, ensure_ascii=False))

    write_hdf5(Path(path), write_contents, overwrite=overwrite)


def _read_rate(file: Any) -> float:
    """Read the sample rate (Hz). Raises ValueError unless it is a positive number."""
    (rate_hz,) = read_numbers_attribute(file, "sample_rate_hz", 1)
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise ValueError(f"sample_rate_hz is {rate_hz:g}; it must be a positive number")
    return rate_hz


def _read_signal(file: Any, name: str, rate_hz: float) -> Signal:
    """Read a signal and convert it to SI: samples times factor plus offset of each channel's unit. Raises ValueError
    where it or an attribute is missing or has another type or shape, or a unit is unknown or not one of the channel's
    quantity."""
    samples = read_float_dataset(file, name, "(samples, channels)")
    quantity, unit, channels = (read_texts_attribute(file[name], key) for key in ("quantity", "unit", "channels"))
    channels = _split_channel_names(channels, samples.shape[1])
    try:
        signal = Signal(samples, rate_hz, collapse_single_text(quantity), collapse_single_text(unit), channels)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    factors, offsets, si_units = [], [], []
    for channel, channel_quantity, unit_text in zip(signal.channels, signal.quantities, signal.units, strict=True):
        try:
            parsed_unit = parse_unit(unit_text)
            check_quantity(channel_quantity, parsed_unit)
        except ValueError as error:
            raise ValueError(f"{name}, channel '{channel}': {error}") from error
        factors.append(parsed_unit.factor)
        offsets.append(parsed_unit.offset)
        si_units.append(parsed_unit.si)
    return Signal(samples * np.array(factors) + np.array(offsets), rate_hz, signal.quantity, tuple(si_units), channels)


def _split_channel_names(channels: tuple[str, ...], column_count: int) -> tuple[str, ...]:
    """Split channel names into one per column. A single text for several columns either lists them, separated by commas
    or spaces, or is a common name that is numbered from 1; other names are returned unchanged."""
    if len(channels) != 1 or column_count < 2:
        return channels
    names = tuple(channels[0].replace(",", " ").split())
    return (
        names if len(names) == column_count else tuple(f"{channels[0]} {number + 1}" for number in range(column_count))
    )


def _read_time_s(file: Any) -> FloatArray | None:
    """Read the time stamps (s), (n,), read-only; None where the file has none."""
    if "time_s" not in file:
        return None
    time_stamps_s = read_float_dataset(file, "time_s", "(samples)")
    time_stamps_s.flags.writeable = False
    return time_stamps_s


def _parse_hold(text: str) -> Hold:
    """Parse the name of a hold. Raises ValueError for an unknown name."""
    if text not in {hold.value for hold in Hold}:
        raise ValueError(f"hold is '{text}'; allowed are {', '.join(hold.value for hold in Hold)}")
    return Hold(text)


def _read_segments(file: Any) -> tuple[Segment, ...]:
    """Read the segments, with amplitudes in SI units; empty where the file has none. Raises ValueError where fields are
    missing."""
    if "segments" not in file:
        return ()
    rows = file["segments"][()]
    field_names = [entry.name for entry in SEGMENT_FIELDS]
    missing_fields = [name for name in field_names if name not in (rows.dtype.names or ())]
    if missing_fields:
        raise ValueError(f"segments lacks {', '.join(missing_fields)}; its rows are {', '.join(field_names)}")
    amplitude_factor = _read_amplitude_factor(file)
    return tuple(_parse_segment(row, amplitude_factor) for row in rows.ravel())


def _parse_segment(row: Any, amplitude_factor: float) -> Segment:
    """Parse a row of the dataset `segments`. amplitude_factor: from the unit of the amplitude to SI."""
    start, stop, period = (int(row[name]) for name in ("start", "stop", "period"))
    kind, role = (row[name].decode() if isinstance(row[name], bytes) else str(row[name]) for name in ("kind", "role"))
    return Segment(start, stop, kind, float(row["amplitude"]) * amplitude_factor, period, role)


def _read_amplitude_factor(file: Any) -> float:
    """Read the factor of the command's unit to SI, which is the unit of the amplitudes; 1 where the factors of its
    channels differ or a unit is unknown."""
    try:
        factors = {parse_unit(text).factor for text in read_texts_attribute(file.get("command", file), "unit")}
    except ValueError:
        return 1.0  # problems of the command are reported by the command itself
    return factors.pop() if len(factors) == 1 else 1.0


def _read_meta(file: Any) -> dict[str, Any]:
    """Read the metadata, each attribute of the group `meta` as JSON; empty without that group. Raises ValueError where
    an attribute is not JSON."""
    metadata: dict[str, Any] = {}
    for key in file["meta"].attrs if "meta" in file else ():
        json_text = read_text_attribute(file["meta"], key)
        try:
            metadata[key] = load_json(json_text)
        except ValueError as error:
            raise ValueError(f"the attribute '{key}' of meta is not JSON: {error}") from error
    return metadata


def _write_signal(file: Any, name: str, signal: Signal, precision: str) -> None:
    """Write a signal as a dataset with its quantity, unit and channel names. precision: a NumPy type."""
    samples = signal.samples.astype(precision)
    compression = {"compression": "gzip", "shuffle": True} if samples.nbytes > _COMPRESS_ABOVE_BYTES else {}
    # The checksum detects samples that were changed on the disk.
    dataset = file.create_dataset(name, data=samples, fletcher32=True, **compression)
    write_texts(dataset, "quantity", signal.quantity)
    write_texts(dataset, "unit", signal.unit)
    write_texts(dataset, "channels", signal.channels)
