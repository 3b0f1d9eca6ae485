"""Identified models as HDF5 files: the format `hapteq-model`, version 1.

A model is a discrete-time linear state space, x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k], with its band, units,
uncertainty and quality; `equalizer.plant.identified_model` validates it.
"""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_quality import ModelQuality
from equalizer.signals.signal import FloatArray
from study.store.disk.file_errors import UnusableFileError, convert_problems
from study.store.disk.hdf5_attributes import (
    collapse_single_text,
    read_numbers_attribute,
    read_provenance_attribute,
    read_texts_attribute,
    write_texts,
)
from study.store.disk.hdf5_file import ProblemCollector, open_hdf5, read_float_dataset, write_hdf5
from study.store.disk.layout import Entry

FORMAT, VERSION = "hapteq-model", 1
"""Name and version of the format, as attributes of the file."""
KIND = "identified model"
"""Name of this kind of file in messages."""

LAYOUT = (
    Entry("format", "attribute, text", f"`{FORMAT}`"),
    Entry("version", "attribute, whole number", f"{VERSION}"),
    Entry("A", "(n, n) float32 or float64", "x[k+1] = A x[k] + B u[k]"),
    Entry("B", "(n, m) float32 or float64", "likewise"),
    Entry("C", "(p, n) float32 or float64", "y[k] = C x[k] + D u[k]"),
    Entry("D", "(p, m) float32 or float64", "likewise"),
    Entry("sample_rate_hz", "attribute, number", "the only sample rate at which the model can run"),
    Entry("band_hz", "attribute, 2 numbers", "frequency band of the fit"),
    Entry("input_unit", "attribute, text or list", "SI; one for all channels, or one per channel"),
    Entry("output_unit", "attribute, text or list", "likewise"),
    Entry("input_channels", "attribute, list of text", "one name per input"),
    Entry("output_channels", "attribute, list of text", "one name per output"),
    Entry("delay_samples", "attribute, number", "for information; A, B, C, D include the delay", False),
    Entry("place_m", "attribute, 3 numbers", "place in the workspace; missing = not known", False),
    Entry(
        "covariance",
        "(k, k) float32 or float64",
        "covariance of the k entries of A, B, C, D, each matrix row by row",
        False,
    ),
    Entry("samples", "(draws, k) float32 or float64", "random draws of the same entries from their uncertainty", False),
    Entry(
        "expected_error",
        "attribute, number",
        "relative error of the model against the device; at least the misfit, scatter and held-out error; missing = "
        "not known",
        False,
    ),
    Entry("misfit_error", "attribute, number", "relative error against the fitted lines, beyond their noise", False),
    Entry(
        "scatter_error", "attribute, number", "relative error that remains because of the noise of those lines", False
    ),
    Entry("held_out_error", "attribute, number", "relative error on a held-out record, its noise included", False),
    Entry("held_out_noise", "attribute, number", "relative noise of that record", False),
    Entry("held_out_s", "attribute, number", "length of that record", False),
    Entry("quality_remarks", "attribute, list of text", "sources of the errors", False),
    Entry("provenance", "attribute, JSON text", "versions, command, seeds, parents", False),
)
"""Contents of the file, for docs/formats.md. n states, m inputs, p outputs, k entries of A, B, C, D together."""


def read_identified_model(path: Path | str) -> IdentifiedModel:
    """Read a model. Raises CannotReadError where the file cannot be read, UnusableFileError with all problems of its
    attributes and arrays or, without any, with those that `IdentifiedModel` finds in their values."""
    path, problems = Path(path), ProblemCollector()
    with open_hdf5(path, KIND, FORMAT, VERSION) as file:
        model_fields = _read_model_fields(file, problems)
    if problems.messages:
        raise UnusableFileError(path, KIND, tuple(problems.messages))
    with convert_problems(path, KIND):
        return IdentifiedModel(**model_fields)


def confirm_identified_model(path: Path) -> bool:
    """Return True if a file's format and version are those of an identified model; the contents are not read. Raises
    CannotReadError or UnusableFileError for any other file, so that the result is never False."""
    with open_hdf5(path, KIND, FORMAT, VERSION):
        return True


def write_identified_model(path: Path | str, model: IdentifiedModel, *, overwrite: bool = False) -> None:
    """Write a model. Raises AlreadyExistsError where the file exists and `overwrite` is False, CannotWriteError where
    it cannot be written."""

    def write_contents(file: Any) -> None:
        """Write attributes and matrices into the open file."""
        file.attrs.update({"format": FORMAT, "version": VERSION, "sample_rate_hz": model.sample_rate_hz})
        file.attrs.update({"band_hz": model.band_hz, "delay_samples": model.delay_samples})
        if model.place_m is not None:
            file.attrs["place_m"] = model.place_m
        for name in ("input_unit", "output_unit", "input_channels", "output_channels"):
            write_texts(file, name, getattr(model, name))
        for name in ("A", "B", "C", "D", "covariance", "samples"):
            if getattr(model, name) is not None:
                file.create_dataset(name, data=getattr(model, name), fletcher32=True)
        if model.quality is not None:
            _write_quality(file, model.quality)
        file.attrs["provenance"] = json.dumps(dict(model.provenance), allow_nan=False)

    write_hdf5(Path(path), write_contents, overwrite=overwrite)


QUALITY_NUMBER_NAMES = tuple(field.name for field in fields(ModelQuality) if field.name != "remarks")
"""Names of the numbers in `ModelQuality`, and of their attributes in the file."""


def _write_quality(file: Any, quality: ModelQuality) -> None:
    """Write the quality of the model as attributes; numbers that are None are left out."""
    for name in QUALITY_NUMBER_NAMES:
        if getattr(quality, name) is not None:
            file.attrs[name] = getattr(quality, name)
    write_texts(file, "quality_remarks", quality.remarks)


def _read_quality(file: Any) -> ModelQuality | None:
    """Read the quality of the model; None if the file states none (older files). A missing misfit error is taken as the
    expected error. Raises ValueError for an unusable attribute."""
    if not {"expected_error", "misfit_error"} & set(file.attrs):
        return None
    numbers = {name: read_numbers_attribute(file, name, 1)[0] for name in QUALITY_NUMBER_NAMES if name in file.attrs}
    remarks = read_texts_attribute(file, "quality_remarks") if "quality_remarks" in file.attrs else ()
    return ModelQuality(
        expected_error=numbers.get("expected_error"),
        misfit_error=numbers["misfit_error" if "misfit_error" in numbers else "expected_error"],
        scatter_error=numbers.get("scatter_error"),
        held_out_error=numbers.get("held_out_error"),
        held_out_noise=numbers.get("held_out_noise"),
        held_out_s=numbers.get("held_out_s"),
        remarks=remarks,
    )


def _read_model_fields(file: Any, problems: ProblemCollector) -> dict[str, Any]:
    """Read the arguments of `IdentifiedModel`, by name. Problems are collected in `problems`; an unreadable field has a
    placeholder value."""

    def read_matrix(name: str) -> FloatArray:
        """Read a matrix; (0, 0) after a problem."""
        return problems.attempt(lambda: read_float_dataset(file, name, "(rows, columns)"), np.empty((0, 0)))

    def read_texts(name: str) -> tuple[str, ...]:
        """Read the texts of an attribute; none after a problem."""
        return problems.attempt(lambda: read_texts_attribute(file, name), ())

    def read_numbers(name: str, count: int, default: tuple[float, ...] | None = None) -> tuple[float, ...]:
        """Read `count` numbers of an attribute; zeros after a problem."""
        return problems.attempt(lambda: read_numbers_attribute(file, name, count, default), (0.0,) * count)

    provenance: dict[str, Any] = problems.attempt(lambda: read_provenance_attribute(file), {})
    optional_matrices = [name for name in ("covariance", "samples") if name in file]
    return {
        **{name: read_matrix(name) for name in ("A", "B", "C", "D", *optional_matrices)},
        **{name: collapse_single_text(read_texts(name)) for name in ("input_unit", "output_unit")},
        **{name: read_texts(name) for name in ("input_channels", "output_channels")},
        "sample_rate_hz": read_numbers("sample_rate_hz", 1)[0],
        "band_hz": read_numbers("band_hz", 2),
        "delay_samples": read_numbers("delay_samples", 1, (0.0,))[0],
        "place_m": read_numbers("place_m", 3) if "place_m" in file.attrs else None,
        "provenance": provenance,
        "quality": problems.attempt(lambda: _read_quality(file), None),
    }
