"""Test a prediction against a recording, per cell: channel x driving input x octave x level of the excitation.

The power of the residual is compared with that of the noise plus an equivalence margin (noncentral F test), which
includes the mismatch of clean recordings, if there are any. p-values are adjusted hierarchically (Benjamini and
Bogomolov, J. R. Stat. Soc. B 76:297, 2014).
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.data.spectral_lines import Band, compute_noncentral_f_sf
from analysis.diagnosis.limits import FALSE_DISCOVERY_RATE, MODEL_FLOOR
from analysis.diagnosis.localisation.model_error_floor import ModelErrorFloor
from analysis.diagnosis.localisation.residual_lines import Observation, ResidualLines, compute_residual_lines
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """A model's response to the recorded command; NaN where not computed."""

    response: FloatArray
    """(n, p), in the units of the recording."""
    position: FloatArray | None = None
    """(n, d), in the units of the recording; None = not predicted."""


@dataclass(frozen=True, slots=True)
class Margin:
    """Equivalence margin: a share of the signal in a cell and the share of clean recordings, squares added."""

    share: float = MODEL_FLOOR
    """Share of the signal, rms, that no model predicts."""
    learned: ModelErrorFloor = field(default_factory=ModelErrorFloor)
    """Relative model errors on clean recordings."""

    def compute_share(self, output: str, quantity: str, input: str, band_hz: Band) -> float:
        """Compute the margin of a cell, as a share of its signal (rms)."""
        return float(np.hypot(self.share, self.learned.get_share(output, quantity, input, band_hz)))


@dataclass(frozen=True, slots=True)
class MismatchCell:
    """The mismatch in a cell of output, driving input, octave and level, with its test."""

    output: str
    quantity: str
    """Quantity of the output: response and position channels may share a name."""
    input: str
    """Driven inputs, joined by "+"."""
    band_hz: Band
    """Lower and upper end of the octave, Hz."""
    amplitude: float
    """Level of the excitation, in the command's unit."""
    rms: float
    """Rms mismatch in the output's unit, noise subtracted."""
    signal_rms: float
    """Rms response in the cell, noise subtracted; at each line at least a tenth of that of the strongest channel of its
    quantity."""
    in_noise: float
    """Rms of the residual, in units of that from noise alone."""
    margin: float
    """Equivalence margin, as a share of the signal."""
    p_value: float
    """p-value: probability of such a residual from noise and a mismatch of the margin's size."""
    adjusted_p_value: float
    """p-value adjusted for the number of cells, nested by channel and band."""
    seconds: float
    """Evaluated time, s."""
    lines: float = 1.0
    """Number of independent lines."""
    freedom: float = 1.0
    """Degrees of freedom of the noise estimate."""
    signal_in_noise: float = 0.0
    """Power of `signal_rms` over the noise's, mean over the lines."""
    part: int = 0
    """Index of the record that contains the cell; 0 until `mismatch_maps` sets it."""
    beyond_noise: bool = False
    """Whether it is significant beyond noise and margin, regardless of the model's error in other cells."""

    @property
    def share(self) -> float:
        """Mismatch over signal, rms; above 1 where the prediction is worse than zero."""
        return self.rms / self.signal_rms if self.signal_rms > 0 else 0.0

    @property
    def significant(self) -> bool:
        """Whether the adjusted p-value is at most `FALSE_DISCOVERY_RATE`."""
        return self.adjusted_p_value <= FALSE_DISCOVERY_RATE


def compute_mismatch_cells(
    recording: Recording,
    prediction: Prediction,
    floor: NoiseFloor,
    used: Mask | None = None,
    margin: Margin | None = None,
) -> tuple[MismatchCell, ...]:
    """Compute and test all cells of a recording. used: (n,), the samples that count; None = all. Empty where the noise
    is not known. `beyond_noise` of each cell is set from its adjusted p-value.

    Raises ValueError where a prediction has another shape than the recording, or `used` another length.
    """
    observations = _make_observations(recording, prediction, floor)
    if not floor.is_known:
        return ()
    used_samples = np.ones(len(recording), dtype=np.bool_) if used is None else used
    if used_samples.shape != (len(recording),):
        raise ValueError(f"the mask of used samples must have shape ({len(recording)},), not {used_samples.shape}")
    equivalence_margin = margin or Margin()
    cells: list[MismatchCell] = []
    for channels, observation in observations:
        groups: dict[tuple[str, Band, float], list[ResidualLines]] = {}
        for lines in compute_residual_lines(recording, observation, used_samples):
            groups.setdefault((lines.input, lines.band_hz, lines.amplitude), []).append(lines)
        for group in groups.values():
            cells += [
                _compute_cell(group, channel, name, observation, equivalence_margin)
                for channel, name in enumerate(channels)
            ]
    return tuple(replace(cell, beyond_noise=cell.significant) for cell in adjust_cell_p_values(cells))


def _make_observations(
    recording: Recording, prediction: Prediction, floor: NoiseFloor
) -> list[tuple[tuple[str, ...], Observation]]:
    """Pair the names of the channels with measured and predicted samples, for the response and, where recording,
    prediction and noise have it, the position. Raises ValueError where shapes differ."""
    pairs = [("response", recording.response, prediction.response, floor.response)]
    if recording.position is not None and prediction.position is not None and floor.position is not None:
        pairs.append(("position", recording.position, prediction.position, floor.position))
    for name, signal, predicted, _ in pairs:
        if predicted.shape != signal.samples.shape:
            raise ValueError(f"the predicted {name} must have shape {signal.samples.shape}, not {predicted.shape}")
    return [
        (signal.channels, Observation(signal.samples, predicted, noise, floor.frequency_hz, signal.quantities))
        for _, signal, predicted, noise in pairs
    ]


def _compute_cell(
    group: Sequence[ResidualLines], channel: int, output: str, observation: Observation, margin: Margin
) -> MismatchCell:
    """Compute and test the cell of one channel. group: its lines in all parts of the recording, of one input, band and
    level; powers are averaged over them by duration, the ratio to the noise by number of lines."""
    first_lines = group[0]
    quantity = observation.quantities[channel]
    margin_share = margin.compute_share(output, quantity, first_lines.input, first_lines.band_hz)
    seconds = np.array([part.seconds for part in group])
    lines = np.array([part.lines for part in group])
    residual, noise, signal = (
        float(np.average([getattr(part, power_name)[channel] for part in group], weights=seconds))
        for power_name in ("residual", "noise", "signal")
    )
    noise_power_ratio = float(np.average([part.whitened[channel] for part in group], weights=lines))
    signal_in_noise, freedom = (
        sum(float(part.signal_to_noise[channel]) for part in group),
        max(float(observation.noise.freedom[channel]), 1.0),
    )
    p_value = float(
        compute_noncentral_f_sf(noise_power_ratio, lines.sum(), freedom, 2 * margin_share**2 * signal_in_noise)
    )
    return MismatchCell(
        output, quantity, first_lines.input, first_lines.band_hz, first_lines.amplitude,
        float(np.sqrt(max(residual - noise, 0.0))), float(np.sqrt(signal)), float(np.sqrt(noise_power_ratio)),
        margin_share, p_value, 1.0, float(seconds.sum()), float(lines.sum()), freedom,
        signal_in_noise / float(lines.sum()),
    )  # fmt: skip


def adjust_cell_p_values(cells: Sequence[MismatchCell]) -> tuple[MismatchCell, ...]:
    """Adjust the p-values of the cells for their number, nested by channel and band; returns the cells with them."""
    paths = [((cell.output, cell.quantity), cell.band_hz) for cell in cells]
    p_values = adjust_nested_p_values(np.array([cell.p_value for cell in cells]), paths, FALSE_DISCOVERY_RATE)
    return tuple(replace(cell, adjusted_p_value=float(p)) for cell, p in zip(cells, p_values, strict=True))


def learn_floor(clean_cells: Sequence[Sequence[MismatchCell]]) -> ModelErrorFloor:
    """Learn the floor: the largest share of each cell over clean recordings and levels, times a factor that is larger
    for fewer recordings (`ModelErrorFloor.margin_factor`). clean_cells: the cells of each recording."""
    shares: dict[tuple[str, str, str, Band], float] = {}
    for cells in clean_cells:
        for cell in cells:
            cell_key = (cell.output, cell.quantity, cell.input, cell.band_hz)
            shares[cell_key] = max(shares.get(cell_key, 0.0), cell.share)
    factor = ModelErrorFloor(recordings=len(clean_cells)).margin_factor
    return ModelErrorFloor(
        {cell_key: factor * share for cell_key, share in shares.items()}, recordings=len(clean_cells)
    )


def adjust_nested_p_values(p_values: FloatArray, families: Sequence[tuple[Hashable, ...]], level: float) -> FloatArray:
    """Adjust p-values (tests,) for hierarchical multiple testing; those up to `level` are significant.

    The false discovery rate is controlled family by family. Families nest (channel, then band, then cell). The p-value
    of a family is that of Simes over its members. Members are tested only where their family is significant, at a level
    lowered by the share of significant families (Benjamini and Bogomolov 2014).

    families: one path per test, widest family first; paths of equal length. The test is the last, innermost member.
    """
    if len(p_values) == 0:
        return p_values.copy()
    adjusted = np.zeros(len(p_values))
    _adjust_families(np.asarray(p_values), families, np.arange(len(p_values)), (0, 1.0, level), adjusted)
    return np.minimum(adjusted, 1.0)


def _adjust_families(
    p_values: FloatArray,
    families: Sequence[tuple[Hashable, ...]],
    members: np.ndarray[tuple[int], np.dtype[np.intp]],
    depth_factor_level: tuple[int, float, float],
    adjusted: FloatArray,
) -> None:
    """Adjust the members of one family, recursively; write to `adjusted` the largest p-value along each path.

    members: indices of the family's tests. depth_factor_level: depth of the family in the paths, factor by which the
    level was lowered above it, and the level."""
    depth, factor, level = depth_factor_level
    if depth == len(families[int(members[0])]):
        adjusted[members] = np.maximum(adjusted[members], factor * _adjust_benjamini_hochberg(p_values[members]))
        return
    groups: dict[Hashable, list[int]] = {}
    for member in members:
        groups.setdefault(families[int(member)][depth], []).append(int(member))
    subfamilies = [np.array(group) for group in groups.values()]
    simes_p_values = np.array([_adjust_benjamini_hochberg(p_values[group]).min() for group in subfamilies])
    family_p_values = factor * _adjust_benjamini_hochberg(simes_p_values)
    significant_count = int(np.sum(family_p_values <= level))
    for group, p_value in zip(subfamilies, family_p_values, strict=True):
        adjusted[group] = np.maximum(adjusted[group], p_value)
        if p_value <= level:
            _adjust_families(
                p_values, families, group, (depth + 1, factor * len(subfamilies) / significant_count, level), adjusted
            )
        else:
            adjusted[group] = np.maximum(adjusted[group], p_values[group])


def _adjust_benjamini_hochberg(p_values: FloatArray) -> FloatArray:
    """Adjust p-values (tests,) by Benjamini and Hochberg (1995); their minimum is the p-value of Simes (1986)."""
    order = np.argsort(p_values)[::-1]
    adjusted = np.empty(len(p_values))
    scaled = p_values[order] * len(p_values) / np.arange(len(p_values), 0, -1)
    adjusted[order] = np.minimum(np.minimum.accumulate(scaled), 1.0)
    return adjusted
