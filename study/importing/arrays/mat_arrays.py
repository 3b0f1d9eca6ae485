"""Read arrays from MAT files of version 5 (Matlab's -v6 and -v7). Begin at `read_mat5_arrays`.

The files are read in Python, not by a C library, so that declared sizes and nesting are checked against the file before
memory is allocated. Real numeric arrays, structures, and cells of similar arrays are read; other cells, texts, objects,
functions and sparse matrices are replaced by placeholders with their kind (a text by its beginning, because labels say
what was measured), a complex array by 0j. Format: MAT-File
Level 5, MathWorks, 2010.
"""

import math
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from study.regular_file import read_regular
from study.store.disk.declared_size import SizeLimit

Array = npt.NDArray[Any]
"""Array of numbers, or a placeholder (an object array with one entry) for one that is not read."""
MAX_MAT_BYTES = 2**32
"""Largest file that is read (4 GiB). Chosen."""
MAX_STRUCTURE_DEPTH = 32
"""Deepest nesting of structures and cells. Chosen: far below Python's recursion limit."""
_HEADER_BYTES = 128
"""Length of a MAT-file's header."""
_COMPRESSED, _MATRIX = 15, 14
"""Data types of the MAT-file format: miCOMPRESSED and miMATRIX."""
_CELL, _STRUCT, _OBJECT, _TEXT, _FIRST_NUMBER, _LAST_NUMBER, _OPAQUE = 1, 2, 3, 4, 6, 15, 17
"""Array classes of the MAT-file format (mxCELL_CLASS and so on)."""
_COMPLEX = 0x0800
"""Flag of an array with an imaginary part."""
_NUMBER_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""NumPy type of the numbers of a data element, by its data type in the MAT-file format."""
_CLASS_NUMBER_TYPES = {
    6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8",
}  # fmt: skip
"""NumPy type of a numeric array, by its array class in the MAT-file format."""
_UNREAD_CLASSES = {_TEXT: "a text", _OBJECT: "an object", 5: "a sparse matrix", 16: "a function"}
"""Array classes that are not read, in words."""
_TEXT_ENCODINGS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
"""Encoding of the characters of a text, by its data type in the MAT-file format."""
_MAX_QUOTED_CHARACTERS = 80
"""Largest number of characters of a text that a description quotes. Chosen."""
_CONVERSIONS = {
    "a cell": "{plain}_1 = {name}{{1}}",
    "an object of the class timeseries": "{name} = struct('time', {name}.Time, 'values', {name}.Data)",
    "an object of the class table": "{name} = table2struct({name}, 'ToScalar', true)",
}
"""Matlab statement that converts an array that is not read to a readable one, by the beginning of its description."""


def suggest_conversion(name: str, kind: str) -> str:
    """Suggest the Matlab statement that converts an array before it is saved; empty where none is known. kind: the
    description of its kind, from `find_unread_reason`."""
    for beginning, statement in _CONVERSIONS.items():
        if kind.startswith(beginning):
            return f"in Matlab: {statement.format(name=name, plain=name.replace('.', '_'))}"
    return ""


def describe_text(text: str) -> str:
    """Describe an array that is a text by the beginning of its first line; "a text" where that is empty."""
    line = "".join(character for character in text.strip().partition("\n")[0] if character.isprintable()).strip()
    ending = " ..." if len(line) > _MAX_QUOTED_CHARACTERS else ""
    return f"the text '{line[:_MAX_QUOTED_CHARACTERS]}{ending}'" if line else "a text"


CELL_ENTRY_PREFIX = re.compile(r"\d+-of-\d+/")
"""Prefix of the name of an array that was an entry of a cell."""


class _CellArrays(tuple[Array, ...]):
    """Similar arrays of a MATLAB cell array, each of which is read as a separate run."""


class _ElementReader:
    """Sequential reader of data elements, from `position` onwards. content: bytes of the file or of an element;
    byte_order: of the file, `<` or `>`."""

    def __init__(self, content: memoryview, byte_order: str) -> None:
        self.content = content
        self.byte_order = byte_order
        self.position = 0

    @property
    def remaining(self) -> int:
        """Number of bytes that are not read yet."""
        return len(self.content) - self.position

    def read_element(self) -> "tuple[int, _ElementReader]":
        """Read data type and content of the next element; `position` moves to its end. An element is a tag of 8 bytes,
        data type and size, and its data, padded to a multiple of 8 bytes unless compressed. Raises ValueError if it is
        longer than the rest of the content."""
        if self.remaining < 8:
            raise ValueError("it is cut off")
        data_type, size = struct.unpack_from(self.byte_order + "II", self.content, self.position)
        start, is_padded = self.position + 8, True
        if data_type >> 16:  # data of up to four bytes are stored in the tag itself
            data_type, size, start = data_type & 0xFFFF, data_type >> 16, self.position + 4
            is_padded = False
        if size > (4 if not is_padded else self.remaining - 8):
            raise ValueError(f"an element of {size} bytes is longer than the rest of the file")
        self.position = self.position + 8 if not is_padded else start + size
        if is_padded and data_type != _COMPRESSED:
            self.position = min(start + -(-size // 8) * 8, len(self.content))
        return data_type, _ElementReader(self.content[start : start + size], self.byte_order)

    def read_numbers(self) -> Array:
        """Read the numbers of the next element. Raises ValueError if its data type is not numeric."""
        data_type, element = self.read_element()
        if data_type not in _NUMBER_TYPES:
            raise ValueError(f"an element of the type {data_type} is found where numbers are needed")
        return np.frombuffer(element.content, np.dtype(self.byte_order + _NUMBER_TYPES[data_type]))


def read_mat5_arrays(path: Path) -> dict[str, Array]:
    """Read all arrays of a file by name: fields of structures as `data.u`, entries of a cell as `2-of-6/u`. Raises
    OSError; ValueError where the file is no MAT file of version 5 or too large; any of `DAMAGE_ERRORS` where it is
    damaged."""
    # The last two bytes of the header state the byte order.
    content = read_regular(path, MAX_MAT_BYTES)
    if len(content) < _HEADER_BYTES or content[126:128] not in (b"IM", b"MI"):
        raise ValueError("it is no MAT file of version 5 to 7.3; save it in Matlab with -v7")
    size_limit = SizeLimit(len(content))
    reader = _ElementReader(memoryview(content)[_HEADER_BYTES:], "<" if content[126:128] == b"IM" else ">")
    arrays: dict[str, Array] = {}
    while reader.remaining >= 8:
        data_type, element = reader.read_element()
        if data_type == _COMPRESSED:
            data_type, element = _decompress(element, size_limit).read_element()
        if data_type == _MATRIX:
            name, value = _read_matrix(element, 0)
            if name and not name.startswith("__"):  # the contents of objects have no name
                _add_arrays(arrays, name, value)
    return arrays


def _decompress(compressed: _ElementReader, size_limit: SizeLimit) -> _ElementReader:
    """Decompress a variable. Raises DeclaredSizeError where it is larger than the limit, zlib.error where it is
    damaged."""
    decompressor = zlib.decompressobj()
    content = decompressor.decompress(compressed.content, size_limit.limit_bytes)
    if decompressor.unconsumed_tail:
        size_limit.add_size("a compressed variable", size_limit.limit_bytes + 1)
    size_limit.add_size("a compressed variable", len(content))
    return _ElementReader(memoryview(content), compressed.byte_order)


def _read_matrix(element: _ElementReader, depth: int) -> tuple[str, Any]:
    """Read name and value of a miMATRIX element: an array or placeholder, a dict for a structure, or the arrays of a
    cell. depth: level of nesting, 0 for a variable. Raises ValueError where it is damaged or too deep."""
    if depth > MAX_STRUCTURE_DEPTH:
        raise ValueError(f"its structures are nested more than {MAX_STRUCTURE_DEPTH} levels deep")
    if not element.remaining:
        return "", np.empty(0)
    flags = int(element.read_numbers()[0])
    array_class = flags & 0xFF
    if array_class == _OPAQUE:
        name, _, class_name = (bytes(element.read_element()[1].content).decode("utf-8", "replace") for _ in range(3))
        return name, _make_placeholder(f"an object of the class {class_name}")
    shape = tuple(int(length) for length in element.read_numbers())
    name = bytes(element.read_element()[1].content).decode("utf-8", "replace")
    if _FIRST_NUMBER <= array_class <= _LAST_NUMBER:
        return name, np.array(0j) if flags & _COMPLEX else _read_numeric(
            element, shape, _CLASS_NUMBER_TYPES[array_class]
        )
    if array_class == _STRUCT:
        return name, _read_structures(element, math.prod(shape), depth)
    if array_class == _CELL:
        return name, _read_cells(element, math.prod(shape), depth)
    if array_class == _TEXT and shape[0] == 1 and element.remaining:
        return name, _make_placeholder(describe_text(_read_text(element)))
    return name, _make_placeholder(_UNREAD_CLASSES.get(array_class, "no array"))


def _make_placeholder(kind: str) -> Array:
    """Make the placeholder for an array that is left out, with its kind as text."""
    return np.array(kind, dtype=object)


def _read_numeric(element: _ElementReader, shape: tuple[int, ...], number_type: str) -> Array:
    """Read a numeric array; Matlab stores columns first. Raises ValueError where its shape and its numbers do not
    agree."""
    values = element.read_numbers()
    if math.prod(shape) != len(values) or min(shape, default=0) < 0:
        raise ValueError(f"an array of the shape {shape} has {len(values)} numbers")
    return values.astype(number_type).reshape(shape, order="F")


def _read_text(element: _ElementReader) -> str:
    """Read the characters of a text of a single row; empty where their encoding is unknown. Raises ValueError where it
    is cut off."""
    data_type, characters = element.read_element()
    encoding = _TEXT_ENCODINGS.get(data_type, "")
    if encoding.startswith("utf-") and encoding != "utf-8":
        encoding += "-le" if element.byte_order == "<" else "-be"
    return bytes(characters.content).decode(encoding, "replace") if encoding else ""


def _read_structures(element: _ElementReader, structure_count: int, depth: int) -> dict[str, Any]:
    """Read the fields of a structure by name; for an array of structures, those of each under its number, as in
    `signals.2`. Raises ValueError where it is damaged."""
    name_length = int(element.read_numbers()[0])
    name_bytes = bytes(element.read_element()[1].content)
    if name_length < 1 or len(name_bytes) % name_length:
        raise ValueError("the names of a structure's fields are damaged")
    field_names = [
        name_bytes[offset : offset + name_length].split(b"\0")[0].decode("utf-8", "replace")
        for offset in range(0, len(name_bytes), name_length)
    ]
    if structure_count * len(field_names) * 8 > element.remaining:
        raise ValueError(
            f"{structure_count} structures of {len(field_names)} fields are longer than the rest of the file"
        )
    structures = [
        {field_name: _read_field(element, field_name, depth) for field_name in field_names}
        for _ in range(structure_count)
    ]
    return (
        structures[0]
        if structure_count == 1
        else {str(number): fields for number, fields in enumerate(structures, start=1)}
    )


def _read_cells(element: _ElementReader, cell_count: int, depth: int) -> Any:
    """Read the arrays of a cell, if all hold numbers and, without dimensions of length 1, have the same number of
    dimensions and the same shorter side; otherwise a placeholder. Raises ValueError where it is damaged."""
    if cell_count * 8 > element.remaining:
        raise ValueError(f"a cell of {cell_count} arrays is longer than the rest of the file")
    arrays = [_read_field(element, f"{number}", depth) for number in range(1, cell_count + 1)]
    if not arrays or not all(
        isinstance(array, np.ndarray) and array.dtype.kind in "fiu" and array.size for array in arrays
    ):
        return _make_placeholder("a cell that contains more than arrays of numbers")
    if (
        len({(squeezed.ndim, min(squeezed.shape) if squeezed.ndim > 1 else 0) for squeezed in map(np.squeeze, arrays)})
        > 1
    ):
        return _make_placeholder("a cell of arrays that are not alike")
    return _CellArrays(arrays)


def _read_field(element: _ElementReader, field_name: str, depth: int) -> Any:
    """Read the value of the next field or entry. field_name: its name, for messages. Raises ValueError where it is no
    array."""
    data_type, nested = element.read_element()
    if data_type != _MATRIX:
        raise ValueError(f"the field '{field_name}' of a structure or cell is damaged")
    return _read_matrix(nested, depth + 1)[1]


def _add_arrays(arrays: dict[str, Array], name: str, value: Any) -> None:
    """Add a value to the arrays found, under names as `read_mat5_arrays` describes."""
    if isinstance(value, dict):
        for field, nested in value.items():
            _add_arrays(arrays, f"{name}.{field}", nested)
    elif isinstance(value, _CellArrays) and len(value) > 1:
        arrays.update({f"{number}-of-{len(value)}/{name}": array for number, array in enumerate(value, start=1)})
    elif isinstance(value, _CellArrays):
        arrays[name] = value[0]
    else:
        arrays[name] = value
