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


def groups_in(arrays: Mapping[str, npt.NDArray[Any]], least: int) -> Groups:
    """Runs in a file, by the separator that gives the largest number of arrays in runs. Each run must contain an array
    of at least `least` samples; without two such runs there are none."""
    long_ones = [name for name, array in arrays.items() if array.size >= least]
    found = [_group_arrays(tuple(arrays), long_ones, separator) for separator in _SEPARATORS]
    return max(found, key=lambda groups: len(groups.prefixes) * len(groups.names))


def _group_arrays(names: Sequence[str], long_ones: Sequence[str], separator: str) -> Groups:
    """Runs by one separator: prefixes that are followed by the same set of names, the most common one."""
    members: dict[str, list[str]] = {}
    for name in names:
        before, between, after = _split(name, separator)
        if (
            before.strip() == before != ""
            and after
            and (separator not in _LOOSE or any(letter.isdigit() for letter in before))
        ):
            members.setdefault(before + between, []).append(after)
    alike = Counter(tuple(sorted(rest)) for rest in members.values())
    usual, count = alike.most_common(1)[0] if alike else ((), 0)
    prefixes = [
        prefix
        for prefix, rest in members.items()
        if tuple(sorted(rest)) == usual and any(prefix + name in long_ones for name in rest)
    ]
    if count < 2 or len(prefixes) < 2:
        return Groups((), {})
    return Groups(tuple(prefixes), {name: prefixes[0] + name for name in members[prefixes[0]]})


def _split(name: str, separator: str) -> tuple[str, str, str]:
    """Prefix, separator and rest of a name, split at its last slash, or else at the first separator. A unit in brackets
    is not searched for separators."""
    plain, bracket, unit = re.match(r"([^\[(]*)([\[(]?)(.*)", name, re.DOTALL).groups()  # type: ignore[union-attr]
    before, between, after = plain.rpartition(separator) if separator == "/" else plain.partition(separator)
    return before, between, after + bracket + unit if between else ""
