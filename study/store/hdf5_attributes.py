"""Attributes of HDF5 files as Python values, however the writing program chose to store them."""

from typing import Any

import h5py
import numpy as np


class AttributeProblemError(ValueError):
    """An attribute is missing or is something else. A sentence fragment for `UnusableFileError`."""


def text_attribute(owner: Any, name: str, default: str | None = None) -> str:
    """Raises AttributeProblemError where there is none and no default."""
    texts = texts_attribute(owner, name, None if default is None else (default,))
    if len(texts) != 1:
        raise AttributeProblemError(f"{_named(owner, name)} holds {len(texts)} texts; it must be one")
    return texts[0]


def texts_attribute(owner: Any, name: str, default: tuple[str, ...] | None = None) -> tuple[str, ...]:
    """One text or a list of texts, as a tuple."""
    if name not in owner.attrs:
        if default is None:
            raise AttributeProblemError(f"{_named(owner, name)} is missing")
        return default
    values = np.atleast_1d(owner.attrs[name]).ravel().tolist()
    if not all(isinstance(value, str | bytes) for value in values):
        raise AttributeProblemError(f"{_named(owner, name)} is {_shown(owner.attrs[name])}; it must be text")
    try:
        return tuple(value.decode("utf-8") if isinstance(value, bytes) else value for value in values)
    except UnicodeDecodeError:
        raise AttributeProblemError(f"{_named(owner, name)} is not text in UTF-8") from None


def numbers_attribute(owner: Any, name: str, count: int, default: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """`count` numbers; a single one may be a scalar or a list of one."""
    if name not in owner.attrs:
        if default is None:
            raise AttributeProblemError(f"{_named(owner, name)} is missing")
        return default
    values = np.atleast_1d(owner.attrs[name]).ravel()
    if values.dtype.kind not in "iuf" or len(values) != count:
        wanted = "a number" if count == 1 else f"{count} numbers"
        raise AttributeProblemError(f"{_named(owner, name)} is {_shown(owner.attrs[name])}; it must be {wanted}")
    return tuple(float(value) for value in values)


def text_or_list(texts: tuple[str, ...]) -> str | tuple[str, ...]:
    """One text for all, or one per channel."""
    return texts[0] if len(texts) == 1 else texts


def write_texts(owner: Any, name: str, texts: str | tuple[str, ...]) -> None:
    if isinstance(texts, str):
        owner.attrs[name] = texts
    else:
        owner.attrs.create(name, list(texts), dtype=h5py.string_dtype())


def _shown(value: Any) -> str:
    return repr(np.asarray(value).tolist())


def _named(owner: Any, name: str) -> str:
    where = owner.name.strip("/")
    return f"the attribute '{name}' of {where}" if where else f"the attribute '{name}'"
