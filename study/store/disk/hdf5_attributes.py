"""Attributes of HDF5 files as Python values, independent of whether they are stored as scalars or as arrays.

Values of another type or number, empty attributes (null dataspace) and those with more than `_MAX_ENTRIES` entries are
refused with an `AttributeProblemError`. `owner` is the file, group or dataset with the attribute.
"""

import math
from typing import Any

import h5py
import numpy as np

from study.store.disk.strict_json import load_json

_MAX_ENTRIES = 1000
"""Largest number of entries of an attribute that is read. Chosen: bounds the memory of a damaged file."""
_MAX_SHOWN_CHARACTERS = 100
"""Largest number of characters of a value in a message. Chosen: about a line."""


class AttributeProblemError(ValueError):
    """An attribute is missing, empty, too large, or of another type. The message is a sentence fragment."""


def read_text_attribute(owner: Any, name: str, default: str | None = None) -> str:
    """Read a single text. Raises AttributeProblemError if it is missing and has no default, or is not one text."""
    texts = read_texts_attribute(owner, name, None if default is None else (default,))
    if len(texts) != 1:
        raise AttributeProblemError(f"{_describe_attribute(owner, name)} holds {len(texts)} texts; it must be one")
    return texts[0]


def read_texts_attribute(owner: Any, name: str, default: tuple[str, ...] | None = None) -> tuple[str, ...]:
    """Read one text or a list of texts, as a tuple. Raises AttributeProblemError if it is missing and has no default,
    is empty or too large, or is not text in UTF-8."""
    if default is not None and name not in owner.attrs:
        return default
    stored_value = _read_value(owner, name)
    values = np.atleast_1d(stored_value).ravel().tolist()
    if not all(isinstance(value, str | bytes) for value in values):
        raise AttributeProblemError(
            f"{_describe_attribute(owner, name)} is {_shorten_value(stored_value)}; it must be text"
        )
    try:
        # h5py returns bytes that are not UTF-8 as surrogates, which cannot be encoded again. The name is checked too.
        encoded_texts = tuple(value if isinstance(value, bytes) else value.encode() for value in (*values, name))
        return tuple(text.decode() for text in encoded_texts[:-1])
    except UnicodeError:
        raise AttributeProblemError(f"{_describe_attribute(owner, name)} is not text in UTF-8") from None


def read_numbers_attribute(
    owner: Any, name: str, count: int, default: tuple[float, ...] | None = None
) -> tuple[float, ...]:
    """Read `count` numbers as floats. Raises AttributeProblemError if they are missing and have no default, or the
    attribute holds another number of values or another type."""
    if default is not None and name not in owner.attrs:
        return default
    stored_value = _read_value(owner, name)
    values = np.atleast_1d(stored_value).ravel()
    if values.dtype.kind not in "iuf" or len(values) != count:
        expected = "a number" if count == 1 else f"{count} numbers"
        raise AttributeProblemError(
            f"{_describe_attribute(owner, name)} is {_shorten_value(stored_value)}; it must be {expected}"
        )
    return tuple(float(value) for value in values)


def read_provenance_attribute(file: Any) -> dict[str, Any]:
    """Read the attribute `provenance`; empty if it is missing. Raises ValueError if it is not a JSON object."""
    text = read_text_attribute(file, "provenance", "{}")
    try:
        provenance = load_json(text)
    except ValueError as error:
        raise ValueError(f"the attribute 'provenance' is not JSON: {error}") from error
    if not isinstance(provenance, dict):
        raise ValueError(f"the attribute 'provenance' is {provenance!r}; it must be a JSON object")
    return provenance


def collapse_single_text(texts: tuple[str, ...]) -> str | tuple[str, ...]:
    """Collapse a tuple of one text, which then holds for all channels, to the text; return any other tuple
    unchanged."""
    return texts[0] if len(texts) == 1 else texts


def write_texts(owner: Any, name: str, texts: str | tuple[str, ...]) -> None:
    """Write an attribute: a text, or a list of texts; an existing one is replaced."""
    if isinstance(texts, str):
        owner.attrs[name] = texts
    else:
        owner.attrs.create(name, list(texts), dtype=h5py.string_dtype())


def _read_value(owner: Any, name: str) -> Any:
    """Read the value as h5py gives it. Raises AttributeProblemError where it is missing, empty or too large."""
    if name not in owner.attrs:
        raise AttributeProblemError(f"{_describe_attribute(owner, name)} is missing")
    shape = owner.attrs.get_id(name).shape
    if shape is None or math.prod(shape) > _MAX_ENTRIES:
        raise AttributeProblemError(
            f"{_describe_attribute(owner, name)} has the shape {shape}; up to {_MAX_ENTRIES} are read"
        )
    return owner.attrs[name]


def _shorten_value(value: Any) -> str:
    """Format the value as text for messages, cut to `_MAX_SHOWN_CHARACTERS`."""
    text = repr(np.asarray(value).tolist())
    return text if len(text) <= _MAX_SHOWN_CHARACTERS else f"{text[:_MAX_SHOWN_CHARACTERS]}…"


def _describe_attribute(owner: Any, name: str) -> str:
    """Name the attribute, and its object unless that is the file, for messages."""
    owner_name = owner.name.strip("/")
    return f"the attribute '{name}' of {owner_name}" if owner_name else f"the attribute '{name}'"
