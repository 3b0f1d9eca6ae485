"""Check the structure of an HDF5 file before its datasets are read, as protection against hostile or damaged files.

A file from another person may refer to other files on this computer (external links, external storage, virtual
datasets), or declare datasets that exceed the memory when they are decompressed; both are refused. `declared_size`
states the size limit.
"""

import math
import zlib
from collections.abc import Iterator
from typing import Any

import h5py

from study.store.disk.declared_size import MIN_LIMIT_BYTES, DeclaredSizeError, SizeLimit

MAX_OBJECTS = 100_000
"""Largest accepted number of groups and datasets in a file. Chosen: bounds time and memory of the checks."""
_COMPRESSION_FILTERS = (h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SZIP, h5py.h5z.FILTER_LZF)
"""HDF5 filters that compress. At most one per dataset is accepted."""
_PYTHON_OBJECT_BYTES = 1024
"""Size (bytes) that is assumed for an element read as a Python object: a variable-length text, a reference or a row of
a table. Chosen as an upper estimate for short texts."""
_MAX_DEFLATE_RATIO = 1032
"""Largest compression ratio of deflate (RFC 1951): a match of 258 bytes may be coded in 2 bits."""


def check_contents(file: Any) -> None:
    """Check the datasets of an open file (`h5py.File`). Raises ValueError where a dataset or the target of a link lies
    in another file, a dataset is compressed more than once, or the file has more than `MAX_OBJECTS` objects;
    DeclaredSizeError, a ValueError, where sizes exceed the limit. The messages are sentence fragments."""
    size_limit = SizeLimit(file.id.get_filesize())
    for name, dataset in iterate_datasets(file):
        _check_dataset(name, dataset, size_limit)


def iterate_datasets(file: Any) -> Iterator[tuple[str, Any]]:
    """Yield (path, dataset) for every dataset below an `h5py.File` or group, each once. Soft links are skipped. Raises
    ValueError at a link to another file, and after `MAX_OBJECTS` objects.

    Replaces `h5py.Group.visititems`, which does not report external links and fails on damaged ones.
    """
    visited_addresses: set[int] = set()
    pending_groups = [("", file)]
    while pending_groups:
        path, group = pending_groups.pop()
        for key in sorted(group, reverse=True):
            name = f"{path}{key}"
            link = group.get(key, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                raise ValueError(f"{name} is a link to another file ({link.filename}); copy the data into this one")
            entry = group[key] if isinstance(link, h5py.HardLink) else None
            if entry is None or (address := h5py.h5o.get_info(entry.id).addr) in visited_addresses:
                continue
            visited_addresses.add(address)
            if len(visited_addresses) > MAX_OBJECTS:
                raise ValueError(f"it holds more than {MAX_OBJECTS} objects")
            if isinstance(entry, h5py.Dataset):
                yield name, entry
            elif isinstance(entry, h5py.Group):
                pending_groups.append((f"{name}/", entry))


def _check_dataset(name: str, dataset: Any, size_limit: SizeLimit) -> None:
    """Raise ValueError where the samples lie in other files or are compressed more than once, DeclaredSizeError where
    the declared sizes with this dataset, or one of its chunks alone, exceed the limit (see also `_check_chunks`).
    size_limit: the size of the dataset is added to it."""
    properties = dataset.id.get_create_plist()
    if properties.get_layout() == h5py.h5d.VIRTUAL or properties.get_external_count():
        raise ValueError(f"the samples of {name} lie in other files; copy them into this one")
    if dataset.shape is None:  # an empty dataset (HDF5 null dataspace)
        return
    filters = [properties.get_filter(index)[0] for index in range(properties.get_nfilters())]
    if sum(filter_code in _COMPRESSION_FILTERS for filter_code in filters) > 1:
        raise ValueError(f"{name} is compressed more than once; save it compressed once, or not at all")
    holds_python_objects = dataset.dtype.hasobject or dataset.dtype.names is not None
    # Numbers are read as float64 (8 bytes).
    element_bytes = _PYTHON_OBJECT_BYTES if holds_python_objects else max(8, dataset.dtype.itemsize)
    size_limit.add_size(name, math.prod(dataset.shape) * element_bytes)
    if dataset.chunks is not None:
        chunk_bytes = math.prod(dataset.chunks) * element_bytes
        if chunk_bytes > size_limit.limit_bytes:
            raise DeclaredSizeError(f"{name} is stored in pieces of {chunk_bytes} bytes; save it in smaller ones")
        if h5py.h5z.FILTER_DEFLATE in filters and dataset.id.get_storage_size() * _MAX_DEFLATE_RATIO > MIN_LIMIT_BYTES:
            _check_chunks(name, dataset, chunk_bytes)


def _check_chunks(name: str, dataset: Any, chunk_bytes: int) -> None:
    """Raise DeclaredSizeError where a chunk of a deflated dataset decompresses to at least twice `chunk_bytes`, the
    memory for its declared size. The HDF5 library decompresses a chunk completely, independent of its declared size;
    chunks that may exceed `MIN_LIMIT_BYTES` are therefore decompressed here first, up to that bound."""

    large_chunk_offsets: list[tuple[int, ...]] = []

    def collect_large_chunk(chunk_info: Any) -> None:
        """Collect the offset of a chunk that may exceed `MIN_LIMIT_BYTES` when it is decompressed."""
        if chunk_info.size * _MAX_DEFLATE_RATIO > MIN_LIMIT_BYTES:
            large_chunk_offsets.append(chunk_info.chunk_offset)

    dataset.id.chunk_iter(collect_large_chunk)
    for chunk_offset in large_chunk_offsets:
        try:
            decompressed = zlib.decompressobj().decompress(
                dataset.id.read_direct_chunk(chunk_offset)[1], 2 * chunk_bytes
            )
        except zlib.error:
            continue  # damaged: the error is reported when the dataset is read
        if len(decompressed) >= 2 * chunk_bytes:
            raise DeclaredSizeError(f"a piece of {name} unpacks to more than the {chunk_bytes} bytes of its size")
