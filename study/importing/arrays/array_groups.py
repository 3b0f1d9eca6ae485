"""Detect several runs in one file by common name prefixes, as in `run1__u, run1__y, run2__u, run2__y`."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

_SEPARATORS = ("__", "/", ".", "_", " ")
"""Separators between the prefix of a run and the name of an array; on a tie the first one counts."""
_LOOSE = ("_", " ", ".")
"""Separators that are also common within names; a prefix before one of them must contain a digit."""


@dataclass(frozen=True, slots=True)
class Groups:
    """Runs in a file, distinguished by prefixes of the arrays' names."""

    prefixes: tuple[str, ...]
    """In the order of the file; empty if it holds one run."""
    names: Mapping[str, str]
    """Arrays of the first run: name without prefix, and full name. Other arrays belong to no run."""


def groups_in(arrays: Mapping[str, npt.NDArray[Any]], min_samples: int) -> Groups:
    """Runs in a file, by the separator that gives the largest number of arrays in runs. Each run must contain an array
    of at least `min_samples` samples; without two such runs there are none."""
    long_names = [name for name, array in arrays.items() if array.size >= min_samples]
    candidates = [_group_arrays(tuple(arrays), long_names, separator) for separator in _SEPARATORS]
    return max(candidates, key=lambda groups: len(groups.prefixes) * len(groups.names))


def _group_arrays(names: Sequence[str], long_names: Sequence[str], separator: str) -> Groups:
    """Runs by one separator: prefixes that are followed by the same set of names, the most common one."""
    members: dict[str, list[str]] = {}
    for name in names:
        run_prefix, mark, stem = _split(name, separator)
        if (
            run_prefix.strip() == run_prefix != ""
            and stem
            and (separator not in _LOOSE or any(letter.isdigit() for letter in run_prefix))
        ):
            members.setdefault(run_prefix + mark, []).append(stem)
    stem_counts = Counter(tuple(sorted(stems)) for stems in members.values())
    common_stems, count = stem_counts.most_common(1)[0] if stem_counts else ((), 0)
    prefixes = [
        prefix
        for prefix, stems in members.items()
        if tuple(sorted(stems)) == common_stems and any(prefix + name in long_names for name in stems)
    ]
    if count < 2 or len(prefixes) < 2:
        return Groups((), {})
    return Groups(tuple(prefixes), {name: prefixes[0] + name for name in members[prefixes[0]]})


def _split(name: str, separator: str) -> tuple[str, str, str]:
    """Prefix, separator and rest of a name, split at its last slash, or else at the first separator. A unit in brackets
    is not searched for separators."""
    text, bracket, unit = re.match(r"([^\[(]*)([\[(]?)(.*)", name, re.DOTALL).groups()  # type: ignore[union-attr]
    prefix, mark, stem = text.rpartition(separator) if separator == "/" else text.partition(separator)
    return prefix, mark, stem + bracket + unit if mark else ""
