"""Test the dependence of a mismatch on states: that of the missing force along each axis, or of a sensor's error.

A state is a variable of the motion or of the signals: position, velocity, command, response, time. The mismatch may be
larger in a region of the state, or follow its sign (`state_regions`); the p-value of each test is multiplied by the
number of all tests of forces, or of sensor errors (Bonferroni). A dependence is stated where the p-value is at most
`FALSE_DISCOVERY_RATE` and, for a region, its share of the mismatch is clearly larger than that of the samples
(`_is_informative`), for at most `MOST_NAMED_STATES` per axis or channel.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.spectral_lines import Band
from analysis.diagnosis.limits import FALSE_DISCOVERY_RATE, MOST_NAMED_STATES, STATE_CONCENTRATION
from analysis.diagnosis.localisation.block_permutation import IntArray
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.diagnosis.localisation.mismatch_rows import StateMismatch
from analysis.diagnosis.localisation.state_regions import (
    MIDDLE_REGION_PHRASE,
    Disturbance,
    State,
    StateRegion,
    find_state_regions,
)
from analysis.diagnosis.types import Mask
from equalizer.effects.placing import shorten_axis_name
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import UnitSystem

_PERMUTATION_SEED = 20
"""Seed of the permutations, fixed so that the same recording gives the same result."""
TESTS_PER_AXIS = 6
"""Tests along one axis: position and velocity by size and by sign, command and time by size."""
TESTS_PER_CHANNEL = 2
"""Tests of one response channel: response and time, by size."""
_LEAST_DRIVEN_SHARE = 0.02
"""Rms of the driving signal in a segment, relative to that of the strongest segment, above which the segment is used.
Chosen by hand."""


def find_force_states(
    evidence: Evidence, recording: Recording, cells: Sequence[MismatchCell], unit_system: UnitSystem
) -> tuple[StateMismatch, ...]:
    """Find regions of state in which the missing force is larger or whose sign it follows, along each driven axis with
    a cell beyond noise. p-values are corrected for all regions tested; only significant ones are returned
    (`_correct_p_values`). unit_system: units of the coordinates."""
    axis_states = []
    for axis_index, channel in enumerate(recording.command.channels):
        channel_cells = [cell for cell in cells if cell.beyond_noise and channel in cell.input.split("+")]
        if not channel_cells:
            continue
        axis_symbol = shorten_axis_name(channel, recording.command.channels)
        length_unit = unit_system.length
        velocity_symbol = "ω" if length_unit == "rad" else "v"
        command = evidence.command[:, axis_index]
        states = [
            State(
                "position",
                axis_symbol if len(axis_symbol) == 1 else "x",
                length_unit,
                evidence.axis_position[:, axis_index],
            ),
            State("velocity", velocity_symbol, f"{length_unit}/s", evidence.axis_velocity[:, axis_index]),
            State("command", channel, "", command),
            State("time", "t", "s", np.arange(len(command)) / evidence.sample_rate_hz),
        ]
        strata = _assign_strata(recording, evidence.used > 0, command)
        worst_cell = max(channel_cells, key=lambda cell: cell.in_noise)
        regions = find_state_regions(
            Disturbance(evidence.axis_force[:, axis_index], strata, command), states, _PERMUTATION_SEED
        )
        axis_states.append(
            [StateMismatch(worst_cell.output, channel, _enclose_bands(channel_cells), region) for region in regions]
        )
    return _correct_p_values(axis_states, TESTS_PER_AXIS)


def find_error_states(
    evidence: Evidence, recording: Recording, cells: Sequence[MismatchCell], channels: Sequence[str]
) -> tuple[StateMismatch, ...]:
    """Find regions of response or time in which the error (reading minus prediction) is larger, for each response
    channel among `channels` with a cell beyond noise. p-values are corrected for all regions tested; only significant
    ones are returned (`_correct_p_values`)."""
    channel_states = []
    for channel_index, channel in enumerate(recording.response.channels):
        quantity = recording.response.quantities[channel_index]
        channel_cells = [
            cell for cell in cells if cell.beyond_noise and (cell.output, cell.quantity) == (channel, quantity)
        ]
        if not channel_cells or channel not in channels:
            continue
        reading = evidence.response[:, channel_index]
        states = [
            State("response", channel, "", reading),
            State("time", "t", "s", np.arange(len(reading)) / evidence.sample_rate_hz),
        ]
        strata = _assign_strata(recording, evidence.used > 0, reading)
        inputs = "+".join(
            command_channel
            for command_channel in recording.command.channels
            if any(command_channel in channel_cell.input.split("+") for channel_cell in channel_cells)
        )
        regions = find_state_regions(
            Disturbance(reading - evidence.predicted[:, channel_index], strata, reading), states, _PERMUTATION_SEED
        )
        channel_states.append(
            [StateMismatch(channel, inputs, _enclose_bands(channel_cells), region) for region in regions]
        )
    return _correct_p_values(channel_states, TESTS_PER_CHANNEL)


def _correct_p_values(groups: Sequence[Sequence[StateMismatch]], tests_per_group: int) -> tuple[StateMismatch, ...]:
    """Correct p-values by Bonferroni over all groups (axes or channels), with tests_per_group tests each. Returns only
    the significant and informative dependences, of each group the `MOST_NAMED_STATES` with the largest share."""
    test_count = tests_per_group * len(groups)
    significant_states = []
    for group in groups:
        corrected = [
            replace(state, region=replace(state.region, p_value=min(1.0, test_count * state.region.p_value)))
            for state in group
        ]
        significant = [
            state
            for state in corrected
            if state.region.p_value <= FALSE_DISCOVERY_RATE and _is_informative(state.region)
        ]
        significant_states += sorted(significant, key=lambda state: -state.region.share)[:MOST_NAMED_STATES]
    return tuple(significant_states)


def _is_informative(region: StateRegion) -> bool:
    """Whether a region is of the kind "sign", or its share of the mismatch is more than `STATE_CONCENTRATION` times its
    share of the samples. Never for a middle region: a mechanical effect is hardly confined to the middle of a state's
    range."""
    if region.description.startswith(MIDDLE_REGION_PHRASE):
        return False
    return region.criterion == "sign" or region.share > STATE_CONCENTRATION * region.sample_share


def _assign_strata(recording: Recording, used_samples: Mask, driving_signal: FloatArray) -> IntArray:
    """Assign to each sample (n,) the index of its segment, rests not counted; -1 where it is not used or belongs to no
    segment, and in weakly driven segments (`_LEAST_DRIVEN_SHARE`). A recording without driven segments is one. The
    permutation test permutes within segments. driving_signal: (n,), command or reading."""
    sample_count = len(driving_signal)
    strata = np.full(sample_count, -1, dtype=np.int64)
    segment_spans = [
        (segment.start, min(segment.stop, sample_count))
        for segment in recording.segments
        if segment.kind != "rest" and segment.start < sample_count
    ] or [(0, sample_count)]
    segment_rms = [float(np.sqrt(np.nanmean(driving_signal[start:stop] ** 2))) for start, stop in segment_spans]
    for segment_index, ((start, stop), rms) in enumerate(zip(segment_spans, segment_rms, strict=True)):
        if rms > _LEAST_DRIVEN_SHARE * max(segment_rms):
            strata[start:stop] = segment_index
    strata[~used_samples] = -1
    return strata


def _enclose_bands(cells: Sequence[MismatchCell]) -> Band:
    """Return the band (Hz) from the lowest to the highest frequency of the cells."""
    return min(cell.band_hz[0] for cell in cells), max(cell.band_hz[1] for cell in cells)
