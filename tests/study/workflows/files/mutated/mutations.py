"""Changes that damage a file: bits, lengths, numbers, nesting, and what an HDF5 file is made of.

A failing case says its seed, its number and its file: `HAPTEQ_MUTATIONS=SEED:COUNT` runs that seed again.
"""

import io
import json
import os
import re

import h5py
import numpy as np

SEED, COUNT = (int(part) for part in os.environ.get("HAPTEQ_MUTATIONS", "20260101:240").split(":"))
NUMBERS = (b"1e999", b"-1e999", b"nan", b"NaN", b"-1", b"0", b"9" * 30, b"1e308", b"-0.0", b"1e-320", b"true", b'""')
VALUES = (None, True, -1, 0, 10**30, 1e308, -1e-320, "", "\ud800", "x" * 3000, [], {}, [[[]]], {"a": {"b": 1}})


def mutated(content: bytes, name: str, rng: np.random.Generator) -> bytes:
    """One to three changes of a random kind."""
    kinds = [flipped, cut, doubled, inserted, removed]
    if not name.endswith((".h5", ".npz", ".npy", ".mat")):
        kinds += [renumbered, renumbered, nested]
    if name.endswith((".json", ".jsonl")):
        kinds += [retyped, retyped, retyped]
    if name.endswith(".h5") or name == "matlab.mat":
        kinds += [restructured, restructured, restructured]
    for _ in range(int(rng.integers(1, 4))):
        content = kinds[int(rng.integers(len(kinds)))](content, rng)
    return content


def place(content: bytes, rng: np.random.Generator) -> int:
    """Somewhere, and half of the time near the beginning, where what matters stands."""
    return int(rng.integers(0, max(1, len(content) if rng.random() < 0.5 else min(len(content), 2000))))


def flipped(content, rng):
    changed = bytearray(content)
    for _ in range(int(rng.integers(1, 20))):
        if changed:
            changed[place(content, rng)] = int(rng.integers(256))
    return bytes(changed)


def cut(content, rng):
    return content[: place(content, rng)]


def doubled(content, rng):
    at, size = place(content, rng), int(rng.integers(1, 2000))
    return content[: at + size] + content[at:]


def inserted(content, rng):
    at = place(content, rng)
    return content[:at] + rng.bytes(int(rng.integers(1, 50))) + content[at:]


def removed(content, rng):
    at = place(content, rng)
    return content[:at] + content[at + int(rng.integers(1, 200)) :]


def renumbered(content, rng):
    numbers = list(re.finditer(rb"-?\d+(\.\d+)?(e-?\d+)?", content))
    if not numbers:
        return content
    found = numbers[int(rng.integers(len(numbers)))]
    return content[: found.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + content[found.end() :]


def nested(content, rng):
    numbers = list(re.finditer(rb"(?<=[=:,])\s*\d+", content))
    depth = int(rng.choice([30, 300, 3000, 30000]))
    deep = [b"[" * depth + b"]" * depth, b'{"a":' * depth + b"1" + b"}" * depth, b"0x" + b"f" * depth, b"(" * depth]
    if not numbers:
        return content
    found = numbers[int(rng.integers(len(numbers)))]
    return content[: found.start()] + deep[int(rng.integers(len(deep)))] + content[found.end() :]


def retyped(content, rng):
    """One value of a document, or of one line of a log, becomes another of any type."""
    lines = content.split(b"\n")
    line = int(rng.integers(len(lines))) if content.count(b"\n{") > 1 else -1
    try:
        document = json.loads(content if line < 0 else lines[line])
    except (ValueError, RecursionError):
        return content
    holders = [(document, key) for key in document] if isinstance(document, dict) else []
    for holder, key in holders:
        inner = holder[key]
        if isinstance(inner, dict):
            holders += [(inner, name) for name in inner]
        elif isinstance(inner, list):
            holders += [(inner, number) for number in range(len(inner))]
    if not holders or len(holders) > 100_000:
        return content
    holder, key = holders[int(rng.integers(len(holders)))]
    holder[key] = VALUES[int(rng.integers(len(VALUES)))]
    try:
        text = json.dumps(document).encode()
    except (ValueError, RecursionError):
        return content
    return text if line < 0 else b"\n".join([*lines[:line], text, *lines[line + 1 :]])


def restructured(content, rng):
    """Another shape, type or value of a dataset or an attribute, by way of the library."""
    buffer = io.BytesIO(content)
    try:
        with h5py.File(buffer, "r+") as file:
            names: list[str] = []
            file.visit(names.append)
            datasets = [name for name in names if isinstance(file[name], h5py.Dataset)]
            name = datasets[int(rng.integers(len(datasets)))]
            owner = file if rng.random() < 0.5 else file[name]
            replaced(file, name, owner, rng)
    except Exception:  # noqa: BLE001 - damaged before: h5py raises what it likes
        return content
    return buffer.getvalue()


def replaced(file, name, owner, rng):
    keys = list(owner.attrs)
    odd = (
        np.nan,
        -1,
        1e308,
        "",
        "x" * 5000,
        np.zeros((30, 30)),
        ["a"] * 500,
        b"\xff",
        np.inf,
        10**18,
        True,
        h5py.Empty("f"),
    )
    match int(rng.integers(7)):
        case 0 if keys:
            owner.attrs[keys[int(rng.integers(len(keys)))]] = odd[int(rng.integers(len(odd)))]
        case 1 if keys:
            del owner.attrs[keys[int(rng.integers(len(keys)))]]
        case 2:
            kept = dict(file[name].attrs)
            del file[name]
            shape = [(), (0,), (0, 0), (5,), (3, 3, 3), (2**40, 2), (2**20, 3), (2**31, 1)][int(rng.integers(8))]
            kind = ["f8", "f4", "i8", "u1", "S4", "c16", "f2", h5py.string_dtype(), h5py.ref_dtype][
                int(rng.integers(9))
            ]
            chunks = True if shape and min(shape) and rng.random() < 0.5 else None
            file.create_dataset(name, shape, kind, chunks=chunks).attrs.update(kept)
        case 3:
            values = file[name][()]
            if getattr(values, "size", 0) and values.dtype.kind == "f":
                values.reshape(-1)[int(rng.integers(values.size))] = rng.choice([np.nan, np.inf, 1e308, -1e308, 1e-320])
                file[name][()] = values
        case 4:
            del file[name]
        case 5:
            file[f"{name}_2"] = h5py.ExternalLink("/etc/passwd", "/x")
        case 6:
            del file[name]
            file.create_dataset(name, (20,), "f8", external=[("/etc/passwd", 0, 160)])
