"""Recordings as HDF5: read into SI units with all checks, written atomically. The format is in `recording_layout`."""

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
from study.store.disk.hdf5_file import Problems, open_hdf5, read_float_dataset, write_hdf5
from study.store.disk.strict_json import load_json
from study.store.formats.recording_layout import FORMAT, KIND, SEGMENT_FIELDS, VERSION

_SEGMENT_TYPE = np.dtype(
    [
        ("start", "<i8"), ("stop", "<i8"), ("kind", h5py.string_dtype()),
        ("amplitude", "<f8"), ("period", "<i8"), ("role", h5py.string_dtype()),
    ]
)  # fmt: skip
"""A row of the dataset `segments`; its fields as in `SEGMENT_FIELDS`."""

_COMPRESS_ABOVE_BYTES = 2**18
"""Arrays above this size are compressed. By hand: smaller ones, of which a session has thousands, are written faster
without."""


def read_recording(path: Path | str) -> Recording:
    """Read a recording in SI units. Raises CannotReadError, or UnusableFileError with all problems."""
    path = Path(path)
    with open_hdf5(path, KIND, FORMAT, VERSION) as file:
        problems = Problems()
        rate_hz = problems.attempt(lambda: _read_rate(file), 1.0)

        def signal(name: str) -> Signal | None:
            return problems.attempt(lambda: _read_signal(file, name, rate_hz), None)

        command, response = signal("command"), signal("response")
        position, excitation, condition = (
            signal(name) if name in file else None for name in ("position", "excitation", "condition")
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
    if wrong := check_recording(recording):
        raise UnusableFileError(path, KIND, wrong)
    return recording


def write_recording(
    path: Path | str,
    recording: Recording,
    *,
    precision: Literal["float32", "float64"] = "float64",
    overwrite: bool = False,
) -> None:
    """Write a recording. `precision` applies to command, response and excitation; position and time are always
    float64, for micrometres in a large workspace. Raises StudyError; ValueError for an inconsistent recording."""
    if wrong := check_recording(recording):
        raise ValueError(f"this recording cannot be written: {'; '.join(wrong)}")

    def fill(file: Any) -> None:
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
            meta.attrs[key] = json.dumps(value, allow_nan=False)

    write_hdf5(Path(path), fill, overwrite=overwrite)


def _read_rate(file: Any) -> float:
    (rate_hz,) = read_numbers_attribute(file, "sample_rate_hz", 1)
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise ValueError(f"sample_rate_hz is {rate_hz:g}; it must be a positive number")
    return rate_hz


def _read_signal(file: Any, name: str, rate_hz: float) -> Signal:
    """A signal, converted to SI: samples times factor plus offset of each channel's unit. Raises ValueError."""
    samples = read_float_dataset(file, name, "(samples, channels)")
    quantity, unit, channels = (read_texts_attribute(file[name], key) for key in ("quantity", "unit", "channels"))
    channels = _split_channel_names(channels, samples.shape[1])
    try:
        signal = Signal(samples, rate_hz, collapse_single_text(quantity), collapse_single_text(unit), channels)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    scale, offset, si = [], [], []
    for channel, word, text in zip(signal.channels, signal.quantities, signal.units, strict=True):
        try:
            parsed = parse_unit(text)
            check_quantity(word, parsed)
        except ValueError as error:
            raise ValueError(f"{name}, channel '{channel}': {error}") from error
        scale.append(parsed.factor)
        offset.append(parsed.offset)
        si.append(parsed.si)
    return Signal(samples * np.array(scale) + np.array(offset), rate_hz, signal.quantity, tuple(si), channels)


def _split_channel_names(channels: tuple[str, ...], columns: int) -> tuple[str, ...]:
    """Channel names: one text for several columns either lists them, or is a common name that is numbered."""
    if len(channels) != 1 or columns < 2:
        return channels
    names = tuple(channels[0].replace(",", " ").split())
    return names if len(names) == columns else tuple(f"{channels[0]} {number + 1}" for number in range(columns))


def _read_time_s(file: Any) -> FloatArray | None:
    if "time_s" not in file:
        return None
    stamps = read_float_dataset(file, "time_s", "(samples)")
    stamps.flags.writeable = False
    return stamps


def _parse_hold(text: str) -> Hold:
    if text not in {hold.value for hold in Hold}:
        raise ValueError(f"hold is '{text}'; allowed are {', '.join(hold.value for hold in Hold)}")
    return Hold(text)


def _read_segments(file: Any) -> tuple[Segment, ...]:
    if "segments" not in file:
        return ()
    rows = file["segments"][()]
    names = [entry.name for entry in SEGMENT_FIELDS]
    missing = [name for name in names if name not in (rows.dtype.names or ())]
    if missing:
        raise ValueError(f"segments lacks {', '.join(missing)}; its rows are {', '.join(names)}")
    scale = _read_amplitude_scale(file)
    return tuple(_parse_segment(row, scale) for row in rows.ravel())


def _parse_segment(row: Any, scale: float) -> Segment:
    start, stop, period = (int(row[name]) for name in ("start", "stop", "period"))
    kind, role = (row[name].decode() if isinstance(row[name], bytes) else str(row[name]) for name in ("kind", "role"))
    return Segment(start, stop, kind, float(row["amplitude"]) * scale, period, role)


def _read_amplitude_scale(file: Any) -> float:
    """Factor to SI: amplitudes have the command's unit; unchanged if its channels differ in unit."""
    try:
        factors = {parse_unit(text).factor for text in read_texts_attribute(file.get("command", file), "unit")}
    except ValueError:
        return 1.0  # problems of the command are reported by the command itself
    return factors.pop() if len(factors) == 1 else 1.0


def _read_meta(file: Any) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for key in file["meta"].attrs if "meta" in file else ():
        text = read_text_attribute(file["meta"], key)
        try:
            values[key] = load_json(text)
        except ValueError as error:
            raise ValueError(f"the attribute '{key}' of meta is not JSON: {error}") from error
    return values


def _write_signal(file: Any, name: str, signal: Signal, precision: str) -> None:
    samples = signal.samples.astype(precision)
    compression = {"compression": "gzip", "shuffle": True} if samples.nbytes > _COMPRESS_ABOVE_BYTES else {}
    # The checksum detects samples that were changed on the disk.
    dataset = file.create_dataset(name, data=samples, fletcher32=True, **compression)
    write_texts(dataset, "quantity", signal.quantity)
    write_texts(dataset, "unit", signal.unit)
    write_texts(dataset, "channels", signal.channels)
