"""Reliability of the lines of a frequency response estimate: which should not be used, with the reasons as sentences.

A line is unreliable below the natural frequency of a virtual spring, where the excitation does not span all inputs, or
where the coherence is low. Called by `transfer_estimate`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray, find_runs

_MIN_INDEPENDENCE = 0.1
"""Singular value to be exceeded by the smallest one of the matrix whose columns are the excited directions, each of
unit length: 1 for as many orthogonal ones as inputs, 0 where they do not span all inputs. Chosen."""


@dataclass(frozen=True, slots=True)
class ReliabilityRules:
    """Thresholds of coherence, frequency and energy below which a line counts as not reliable. All are chosen."""

    least_coherence: float = 0.5
    """Least coherence of the output with the lowest one."""
    spring_margin: float = 1.1
    """Lowest frequency, as a multiple of the virtual spring's natural frequency: below, the spring compensates most of
    the excitation."""
    least_energy_db: float = -12.0
    """Least energy, relative to an experiment's strongest line, per line or per octave, whichever is more favourable:
    sweeps have constant energy per octave, multisines per line, and both fall off steeply outside their band."""


@dataclass(frozen=True, slots=True, eq=False)
class LineReliability:
    """Mask of the reliable lines, and the reasons why others are not, as sentences; result of `judge_lines`."""

    reliable: BoolArray
    """(lines,): whether each line is reliable."""
    remarks: tuple[str, ...]


def judge_lines(
    frequency_hz: FloatArray, excited: BoolArray, coherence: FloatArray, spring_hz: float, rules: ReliabilityRules
) -> LineReliability:
    """Judge each line. frequency_hz: (lines,), rising. excited: (lines,), by `find_excited_lines`. coherence: (lines,
    outputs); NaN = not known, counts as 1. spring_hz: natural frequency of a virtual spring; 0 = no spring."""
    remarks = []
    is_below_spring = frequency_hz < rules.spring_margin * spring_hz
    if is_below_spring.any():
        remarks.append(
            f"Below {rules.spring_margin * spring_hz:.2f} Hz lines are not reliable: the virtual spring "
            f"({spring_hz:g} Hz) absorbs most of the excitation there."
        )
    is_unexcited = ~excited & ~is_below_spring
    if is_unexcited.any():
        remarks.append(
            f"Not reliable, because not every direction was excited: {_describe_spans(frequency_hz, is_unexcited)}."
        )
    worst_coherence = np.min(np.where(np.isnan(coherence), 1.0, coherence), axis=1, initial=1.0)
    is_noisy = (worst_coherence < rules.least_coherence) & excited & ~is_below_spring
    if is_noisy.any():
        remarks.append(
            f"Not reliable, because noise is more than {100 * (1 - rules.least_coherence):g} % of an output's power: "
            f"{_describe_spans(frequency_hz, is_noisy)}."
        )
    return LineReliability(~(is_below_spring | is_unexcited | is_noisy), tuple(remarks))


def find_excited_lines(
    frequency_hz: FloatArray, excitation: ComplexArray, units: Sequence[str], least_energy_db: float
) -> BoolArray:
    """Find the lines at which the excitations span as many directions as there are inputs.

    excitation: spectra (lines, inputs, experiments), at least as many experiments as inputs. units: of the inputs;
    the inputs of each unit, such as N and N m, are scaled to an rms of 1, so that they can be compared. Returns a
    mask (lines,): where the smallest singular value of the excitations with at least `least_energy_db` of energy
    (`ReliabilityRules`), each of unit length, exceeds `_MIN_INDEPENDENCE`.
    """
    has_same_unit = np.equal.outer(units, units)
    input_power = has_same_unit @ np.mean(np.abs(excitation) ** 2, axis=(0, 2)) / has_same_unit.sum(axis=1)
    excitation = excitation / np.sqrt(np.maximum(input_power, np.finfo(np.float64).tiny))[:, None]
    least_power = 10 ** (least_energy_db / 10)
    power = np.sum(np.abs(excitation) ** 2, axis=1)
    power_per_octave = power * frequency_hz[:, None]
    is_strong = (power >= least_power * power.max(axis=0)) | (
        power_per_octave >= least_power * power_per_octave.max(axis=0)
    )
    excitation_norms = np.sqrt(np.maximum(power, np.finfo(np.float64).tiny))
    directions = np.where(is_strong[:, None, :], excitation / excitation_norms[:, None, :], 0.0)
    spans_inputs: BoolArray = np.linalg.svd(directions, compute_uv=False)[:, -1] > _MIN_INDEPENDENCE
    return spans_inputs


def find_spring_frequency_hz(metadata_items: Sequence[Mapping[str, Any]]) -> float:
    """Find the highest natural frequency (Hz) of a virtual spring in the metadata of recordings; 0 where there is
    none."""
    frequencies_hz = [0.0]
    for metadata in metadata_items:
        feedback = metadata.get("feedback")
        natural_hz = feedback.get("natural_frequency_hz") if isinstance(feedback, Mapping) else None
        if isinstance(natural_hz, int | float) and np.isfinite(natural_hz):
            frequencies_hz.append(float(natural_hz))
    return max(frequencies_hz)


def _describe_spans(frequency_hz: FloatArray, is_selected: BoolArray) -> str:
    """Describe the selected lines: up to three spans, such as "1 to 4 Hz and from 38 Hz on", else their number and
    range. is_selected: (lines,), true for at least one."""
    spans = find_runs(is_selected)
    if len(spans) > 3:
        first, last = frequency_hz[is_selected][[0, -1]]
        return f"{int(is_selected.sum())} lines between {first:.4g} and {last:.4g} Hz"
    return " and ".join(_describe_span(frequency_hz, first, stop - 1) for first, stop in spans)


def _describe_span(frequency_hz: FloatArray, first: int, last: int) -> str:
    """Describe the span of lines from index first to last (included); "from ... on" where it reaches the last line."""
    if last == len(frequency_hz) - 1 and first > 0:
        return f"from {frequency_hz[first]:.4g} Hz on"
    return f"{frequency_hz[first]:.4g} to {frequency_hz[last]:.4g} Hz"
