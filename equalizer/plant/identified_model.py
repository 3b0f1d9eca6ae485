"""Discrete-time linear state-space model fitted to recordings, with its band of validity and its uncertainty:

    x[k+1] = A x[k] + B u[k],    y[k] = C x[k] + D u[k]         x (n,), u (m,) commands, y (p,) responses

`equalizer.identification.state_space` fits such models.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from equalizer.plant.model_quality import ModelQuality
from equalizer.signals.listed_problems import ListedProblemsError
from equalizer.signals.signal import FloatArray, collect_names, list_per_channel
from equalizer.signals.summary import Summary, SummaryDisplay, format_range
from equalizer.signals.units import UnknownUnitError, parse_unit


class IdentifiedModelError(ListedProblemsError):
    """A model's values are inconsistent. `problems`: a sentence for each inconsistency."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class IdentifiedModel(SummaryDisplay):
    """A discrete-time state-space model in SI units. As in recordings, y[k] is sampled just before u[k] is written, so
    that D is zero for a strictly causal device, unless D approximates the modes outside the band.

    Raises IdentifiedModelError for inconsistent values. An unstable model is permitted; see `spectral_radius`.
    """

    A: FloatArray
    """(n, n)"""
    B: FloatArray
    """(n, m)"""
    C: FloatArray
    """(p, n)"""
    D: FloatArray
    """(p, m)"""
    sample_rate_hz: float
    """Rate (Hz) at which commands are written and responses are sampled."""
    band_hz: tuple[float, float]
    """Frequency band of the fit (Hz), lower and upper limit; the model is not valid outside it."""
    input_unit: str | tuple[str, ...]
    """SI unit of all commands, or the units channel by channel."""
    output_unit: str | tuple[str, ...]
    """SI unit of all responses, or the units channel by channel."""
    input_channels: tuple[str, ...]
    """Names of the m commands."""
    output_channels: tuple[str, ...]
    """Names of the p responses."""
    delay_samples: float = 0.0
    """Delay in samples from a command to the first response that it can change. For information only: A, B, C, D
    include it."""
    place_m: tuple[float, float, float] | None = None
    """Position of the handle in the workspace (m); None = not known."""
    covariance: FloatArray | None = None
    """(k, k): covariance matrix of `parameters`; None = not known."""
    samples: FloatArray | None = None
    """(draws, k): random draws of `parameters` from the distribution of their errors; None = not known."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Origin, as JSON values: versions, command line, random seeds, input files."""
    quality: ModelQuality | None = None
    """Relative errors of the model: misfit, scatter and held-out error; None = not known."""

    def __post_init__(self) -> None:
        """Copy the arrays as read-only double precision, and check the values, but not `provenance` and `quality`.
        Raises IdentifiedModelError."""
        for name in ("A", "B", "C", "D", "covariance", "samples"):
            if getattr(self, name) is not None:
                matrix = np.array(getattr(self, name), dtype=np.float64, ndmin=1)
                matrix.flags.writeable = False
                object.__setattr__(self, name, matrix)
        for name in ("input_channels", "output_channels"):
            object.__setattr__(self, name, collect_names(getattr(self, name)))
        problems = tuple(_list_problems(self))
        if problems:
            raise IdentifiedModelError(problems)

    @property
    def order(self) -> int:
        """Number of states, n."""
        return int(self.A.shape[0])

    @property
    def input_units(self) -> tuple[str, ...]:
        """The unit of each command."""
        return list_per_channel(self.input_unit, len(self.input_channels))

    @property
    def output_units(self) -> tuple[str, ...]:
        """The unit of each response."""
        return list_per_channel(self.output_unit, len(self.output_channels))

    @property
    def parameters(self) -> FloatArray:
        """(k,): the entries of A, B, C and D in this order, each matrix row by row."""
        return np.concatenate([matrix.ravel() for matrix in (self.A, self.B, self.C, self.D)])

    def replace_parameters(self, parameters: FloatArray) -> Self:
        """Copy the model with other entries of A, B, C, D. parameters: (k,), in the order of the property
        `parameters`. Raises ValueError for another number of entries, IdentifiedModelError for entries that are not
        finite."""
        shapes = [matrix.shape for matrix in (self.A, self.B, self.C, self.D)]
        split_indices = np.cumsum([rows * columns for rows, columns in shapes])[:-1]
        flat_matrices = np.split(np.asarray(parameters, dtype=np.float64), split_indices)
        A, B, C, D = (flat_matrix.reshape(shape) for flat_matrix, shape in zip(flat_matrices, shapes, strict=True))
        return replace(self, A=A, B=B, C=C, D=D)

    @property
    def spectral_radius(self) -> float:
        """Largest magnitude of the eigenvalues of A; below 1 the model is stable. 0 for a model without states."""
        return float(np.abs(np.linalg.eigvals(self.A)).max()) if self.order else 0.0

    def summary(self) -> Summary:
        """Summarise order, channels, band, rate and spectral radius, for printing."""
        low_hz, high_hz = self.band_hz
        return Summary(
            "Identified state-space model",
            (
                ("order", str(len(self.A))),
                ("from", ", ".join(self.input_channels)),
                ("to", ", ".join(self.output_channels)),
                ("band", format_range(low_hz, high_hz, "Hz")),
                ("sample rate", f"{self.sample_rate_hz:g} Hz"),
                ("spectral radius", f"{self.spectral_radius:.6f}"),
            ),
        )


def _list_problems(model: IdentifiedModel) -> Iterator[str]:
    """List all inconsistencies of a model, a sentence each. Uncertainties are checked only where A, B, C and D
    are valid."""
    shape_problems = tuple(_list_shape_problems(model))
    yield from shape_problems
    yield from _list_channel_problems("input", model.input_channels, model.input_unit, model.B.shape[-1])
    yield from _list_channel_problems("output", model.output_channels, model.output_unit, model.C.shape[0])
    rate_hz, (low_hz, high_hz) = model.sample_rate_hz, model.band_hz
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        yield f"sample_rate_hz is {rate_hz}; it must be a positive number"
    elif not 0 <= low_hz < high_hz <= rate_hz / 2:
        yield (
            f"band_hz is {low_hz:g} to {high_hz:g}; it must rise within 0 and half the sample rate, {rate_hz / 2:g} Hz"
        )
    if not (np.isfinite(model.delay_samples) and model.delay_samples >= 0):
        yield f"delay_samples is {model.delay_samples}; it must be a number that is not negative"
    if model.place_m is not None and (np.shape(model.place_m) != (3,) or not np.isfinite(model.place_m).all()):
        yield f"place_m is {model.place_m}; it must be three numbers, x, y, z in metres"
    if not shape_problems:
        yield from _list_uncertainty_problems(model)


def _list_shape_problems(model: IdentifiedModel) -> Iterator[str]:
    """List matrices of a wrong shape or with values that are not finite."""
    n, m, p = model.A.shape[0], model.B.shape[-1], model.C.shape[0]
    for name, shape in {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}.items():
        matrix: FloatArray = getattr(model, name)
        if matrix.shape != shape:
            yield f"{name} has shape {matrix.shape}, but order {n}, {m} inputs and {p} outputs require {shape}"
        elif not np.isfinite(matrix).all():
            yield f"{name} holds values that are not finite numbers"


def _list_channel_problems(
    direction: str, channels: tuple[str, ...], unit: str | tuple[str, ...], channel_count: int
) -> Iterator[str]:
    """List a wrong number of channels or units, repeated channels and units outside SI. direction: "input" or "output";
    channel_count: number of channels of the matrices."""
    if len(channels) != channel_count:
        yield f"{direction}_channels names {len(channels)} channels, but the matrices have {channel_count}"
    if len(set(channels)) != len(channels):
        yield f"{direction}_channels names a channel twice: {', '.join(channels)}"
    units = (unit,) if isinstance(unit, str) else unit
    if len(units) not in (1, channel_count):
        yield f"{direction}_unit holds {len(units)} units for {channel_count} channels; one for all, or one per channel"
    for unit_text in units:
        try:
            parsed_unit = parse_unit(unit_text)
        except UnknownUnitError as error:
            yield f"{direction}_unit: {error}"
        else:
            if parsed_unit.si != unit_text:
                yield f"{direction}_unit is '{unit_text}'; a model is in SI units, here {parsed_unit.si}"


def _list_uncertainty_problems(model: IdentifiedModel) -> Iterator[str]:
    """List errors of shape and values of covariance and samples. Of positive semidefiniteness, only the sign of the
    variances is checked."""
    k = model.parameters.size
    covariance, samples = model.covariance, model.samples
    if covariance is not None:
        if covariance.shape != (k, k):
            yield f"covariance has shape {covariance.shape}, but the {k} entries of A, B, C, D need ({k}, {k})"
        elif not np.isfinite(covariance).all():
            yield "covariance holds values that are not finite numbers"
        elif not np.allclose(covariance, covariance.T, rtol=1e-6, atol=1e-12 * float(np.abs(covariance).max())):
            yield "covariance is not symmetric"
        elif (np.diag(covariance) < 0).any():
            yield "covariance has a negative variance on its diagonal"
    if samples is not None:
        if samples.ndim != 2 or samples.shape[1] != k or not len(samples):
            yield f"samples has shape {samples.shape}, but must be (draws, {k}): the entries of A, B, C, D per draw"
        elif not np.isfinite(samples).all():
            yield "samples holds values that are not finite numbers"
