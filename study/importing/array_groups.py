"""Find the runs in one file by the common prefixes of array names, as in `run1__u, run1__y, run2__u, run2__y`.

Called by `study.importing.header_map` and `map_skeleton`, which propose a part of the recording for each run.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.surplus_arrays import is_growing_time

_SEPARATORS = ("__", "/", ".", "_", " ")
"""Separators between the prefix of a run and the name of an array. Where several give equally many arrays, the first
counts."""
_AMBIGUOUS_SEPARATORS = ("_", " ", ".")
"""Separators that are common within names, too; a prefix before one of them must contain a digit."""
_LATEST_FIRST_SAMPLE = 1.5
"""Latest first sample of a run that counts its time or samples from its own beginning, in steps: 1, with a margin for
rounding."""


@dataclass(frozen=True, slots=True)
class RunGroups:
    """Runs in a file, distinguished by prefixes of the arrays' names."""

    prefixes: tuple[str, ...]
    """Prefixes with their separator, in the order of the file; empty if it holds one run."""
    names: Mapping[str, str]
    """Full name of each array of the first run, by its name without prefix; empty if the file holds one run."""


def find_runs(arrays: Mapping[str, npt.NDArray[Any]], min_samples: int) -> RunGroups:
    """Find the runs in a file, by the separator that gives the largest number of arrays in runs. Each run must contain
    an array of at least `min_samples` values; without two such runs the result is empty, and so it is where the first
    two were recorded at the same time (`_are_simultaneous`). arrays: in the order of the file, by name."""
    long_array_names = [name for name, array in arrays.items() if array.size >= min_samples]
    candidates = [_group_arrays(tuple(arrays), long_array_names, separator) for separator in _SEPARATORS]
    groups = max(candidates, key=lambda groups: len(groups.prefixes) * len(groups.names))
    return RunGroups((), {}) if groups.prefixes and _are_simultaneous(arrays, groups) else groups


def _are_simultaneous(arrays: Mapping[str, npt.NDArray[Any]], groups: RunGroups) -> bool:
    """Whether the first two groups are parts of one run, such as the scopes of a Simulink model: both contain the same
    rising times, and these begin later than a step after zero, where each of several runs may begin."""
    first, second = groups.prefixes[:2]
    for name in groups.names:
        times = arrays[first + name]
        if is_growing_time(name, times) and np.array_equal(times, arrays[second + name]):
            first_step = times[times > times[0]][0] - times[0]
            if times[0] < 0 or times[0] > _LATEST_FIRST_SAMPLE * first_step:
                return True
    return False


def _group_arrays(names: Sequence[str], long_names: Sequence[str], separator: str) -> RunGroups:
    """Find the runs by one separator: the prefixes that are followed by the most common set of names. long_names: names
    of arrays of which each run must contain at least one."""
    stems_by_prefix: dict[str, list[str]] = {}
    for name in names:
        run_prefix, found_separator, stem = _split_name(name, separator)
        if (
            run_prefix.strip() == run_prefix != ""
            and stem
            and (separator not in _AMBIGUOUS_SEPARATORS or any(letter.isdigit() for letter in run_prefix))
        ):
            stems_by_prefix.setdefault(run_prefix + found_separator, []).append(stem)
    stem_counts = Counter(tuple(sorted(stems)) for stems in stems_by_prefix.values())
    common_stems, prefix_count = stem_counts.most_common(1)[0] if stem_counts else ((), 0)
    prefixes = [
        prefix
        for prefix, stems in stems_by_prefix.items()
        if tuple(sorted(stems)) == common_stems and any(prefix + name in long_names for name in stems)
    ]
    if prefix_count < 2 or len(prefixes) < 2:
        return RunGroups((), {})
    return RunGroups(tuple(prefixes), {name: prefixes[0] + name for name in stems_by_prefix[prefixes[0]]})


def _split_name(name: str, separator: str) -> tuple[str, str, str]:
    """Split a name into prefix, separator and rest: at its last slash for the separator "/", else at the first
    separator. The text from the first bracket on (a unit) is not searched. Without the separator the rest is empty."""
    searched_text, bracket, unit = re.match(r"([^\[(]*)([\[(]?)(.*)", name, re.DOTALL).groups()  # type: ignore[union-attr]
    prefix, found_separator, stem = (
        searched_text.rpartition(separator) if separator == "/" else searched_text.partition(separator)
    )
    return prefix, found_separator, stem + bracket + unit if found_separator else ""
