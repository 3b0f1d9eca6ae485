"""Checks of the structure of an HDF5 file before its contents are read.

A file from another person may refer to other files on this computer, or declare contents that exceed the memory when
they are unpacked; both are refused (`declared_size` states the limit).
"""

import math
import zlib
from collections.abc import Iterator
from typing import Any

import h5py

from study.store.disk.declared_size import PLAIN_BYTES, DeclaredSizeError, SizeLimit

MOST_OBJECTS = 100_000
"""Largest number of groups and datasets of a file; bounds time and memory of the checks."""
_COMPRESSIONS = (h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SZIP, h5py.h5z.FILTER_LZF)
"""Filters that decompress: their output may be larger than the data on the disk."""
_OBJECT_BYTES = 1024
"""Upper estimate of the size of a Python object for a variable-length text, a reference or a table row."""
_DEFLATE_FACTOR = 1032
"""Largest compression ratio of deflate (zlib): 2 bits for 258 bytes."""


def check_contents(file: Any) -> None:
    """Check that an open file refers to no other file and declares no oversized contents. Raises ValueError with a
    sentence fragment for external data, DeclaredSizeError (a ValueError) for oversized datasets."""
    limit = SizeLimit(file.id.get_filesize())
    for name, dataset in datasets_in(file):
        _check_dataset(name, dataset, limit)


def datasets_in(file: Any) -> Iterator[tuple[str, Any]]:
    """Every dataset once, with its path. Raises ValueError for links to other files, and for more than `MOST_OBJECTS`
    objects; symbolic links within the file are skipped.

    h5py's own visitors do not report external links, and fail on damaged ones.
    """
    visited: set[int] = set()
    waiting = [("", file)]
    while waiting:
        path, group = waiting.pop()
        for key in sorted(group, reverse=True):
            name = f"{path}{key}"
            link = group.get(key, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                raise ValueError(f"{name} is a link to another file ({link.filename}); copy the data into this one")
            entry = group[key] if isinstance(link, h5py.HardLink) else None
            if entry is None or (address := h5py.h5o.get_info(entry.id).addr) in visited:
                continue
            visited.add(address)
            if len(visited) > MOST_OBJECTS:
                raise ValueError(f"it holds more than {MOST_OBJECTS} objects")
            if isinstance(entry, h5py.Dataset):
                yield name, entry
            elif isinstance(entry, h5py.Group):
                waiting.append((f"{name}/", entry))


def _check_dataset(name: str, dataset: Any, limit: SizeLimit) -> None:
    """Raise ValueError where the dataset lies in other files or is compressed more than once, DeclaredSizeError where
    it is too large."""
    properties = dataset.id.get_create_plist()
    if properties.get_layout() == h5py.h5d.VIRTUAL or properties.get_external_count():
        raise ValueError(f"the samples of {name} lie in other files; copy them into this one")
    if dataset.shape is None:  # an empty dataset (HDF5 null dataspace)
        return
    filters = [properties.get_filter(number)[0] for number in range(properties.get_nfilters())]
    if sum(code in _COMPRESSIONS for code in filters) > 1:
        raise ValueError(f"{name} is compressed more than once; save it compressed once, or not at all")
    in_python = dataset.dtype.hasobject or dataset.dtype.names is not None
    entry_bytes = _OBJECT_BYTES if in_python else max(8, dataset.dtype.itemsize)  # read as float64
    limit.add_size(name, math.prod(dataset.shape) * entry_bytes)
    if dataset.chunks is not None:
        chunk_bytes = math.prod(dataset.chunks) * entry_bytes
        if chunk_bytes > limit.most_bytes:
            raise DeclaredSizeError(f"{name} is stored in pieces of {chunk_bytes} bytes; save it in smaller ones")
        if h5py.h5z.FILTER_DEFLATE in filters and dataset.id.get_storage_size() * _DEFLATE_FACTOR > PLAIN_BYTES:
            _check_pieces(name, dataset, chunk_bytes)


def _check_pieces(name: str, dataset: Any, chunk_bytes: int) -> None:
    """Raise DeclaredSizeError where a compressed chunk unpacks to at least twice its declared size. HDF5 decompresses a
    chunk completely, independent of its declared size; chunks that may become large are therefore decompressed here,
    up to that limit."""

    large: list[tuple[int, ...]] = []

    def look(stored: Any) -> None:
        if stored.size * _DEFLATE_FACTOR > PLAIN_BYTES:
            large.append(stored.chunk_offset)

    dataset.id.chunk_iter(look)
    for offset in large:
        try:
            unpacked = zlib.decompressobj().decompress(dataset.id.read_direct_chunk(offset)[1], 2 * chunk_bytes)
        except zlib.error:
            continue  # damaged: reading the data reports it
        if len(unpacked) >= 2 * chunk_bytes:
            raise DeclaredSizeError(f"a piece of {name} unpacks to more than the {chunk_bytes} bytes of its size")
