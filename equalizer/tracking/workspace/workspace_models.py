"""Set of models of one device, each identified at a different place of its workspace, checked to be compatible.

The response of a device changes with the pose of its mechanism; `modal_interpolation` and `blended_inverse` interpolate
between the places.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray

Place = tuple[float, float, float]
"""Coordinates x, y, z of the handle, m."""

SAME_PLACE_M = 1e-4
"""Distance (m) below which two places count as the same. Chosen."""


class WorkspaceError(ValueError):
    """Models cannot be used together, or a place for them is missing or invalid."""


@dataclass(frozen=True, slots=True, eq=False)
class WorkspaceModels:
    """Models of one device at several places of its workspace. A single model needs no place: it is used everywhere.

    Raises WorkspaceError where there is no model, a model is unstable, models differ in sample rate, channels or units,
    have no band in common, lie less than `SAME_PLACE_M` apart, or where one of several models has no place.
    """

    models: tuple[IdentifiedModel, ...]

    def __post_init__(self) -> None:
        if not self.models:
            raise WorkspaceError("no model was given; at least one is needed")
        for number, model in enumerate(self.models, start=1):
            _check_compatible(self.models[0], model, number)
        if len(self.models) > 1:
            _check_places(self.models)
        low_hz, high_hz = self.band_hz
        if not low_hz < high_hz:
            bands = ", ".join("{:g} to {:g} Hz".format(*model.band_hz) for model in self.models)
            raise WorkspaceError(f"the models have no band in common: {bands}; identify them on the same band")

    def __len__(self) -> int:
        return len(self.models)

    @property
    def places_m(self) -> FloatArray:
        """(models, 3), m; the origin for a model without a place, which only a single model may be."""
        return np.array([model.place_m or (0.0, 0.0, 0.0) for model in self.models], dtype=np.float64)

    @property
    def band_hz(self) -> tuple[float, float]:
        """Lower and upper end (Hz) of the band that all models cover."""
        return max(model.band_hz[0] for model in self.models), min(model.band_hz[1] for model in self.models)

    def without_model(self, index: int) -> "WorkspaceModels":
        """Return the set without the model at the index (from 0). Raises WorkspaceError where no model would remain."""
        return WorkspaceModels(self.models[:index] + self.models[index + 1 :])


def _check_compatible(first_model: IdentifiedModel, model: IdentifiedModel, number: int) -> None:
    """Raise WorkspaceError where a model differs from the first in rate, channels or units, or is unstable. number: of
    the model, from 1, for the message."""
    for property_name, first_value, value in (
        ("sample rate", first_model.sample_rate_hz, model.sample_rate_hz),
        ("input channels", first_model.input_channels, model.input_channels),
        ("output channels", first_model.output_channels, model.output_channels),
        ("input unit", first_model.input_unit, model.input_unit),
        ("output unit", first_model.output_unit, model.output_unit),
    ):
        if first_value != value:
            raise WorkspaceError(f"model {number} has the {property_name} {value}, but the first has {first_value}")
    if model.spectral_radius >= 1:
        raise WorkspaceError(f"model {number} is not stable, so nothing can be played through it; identify it again")


def _check_places(models: tuple[IdentifiedModel, ...]) -> None:
    """Raise WorkspaceError where one of at least two models has no place, or two lie less than `SAME_PLACE_M` apart."""
    numbers_without_place = [str(number) for number, model in enumerate(models, start=1) if model.place_m is None]
    if numbers_without_place:
        raise WorkspaceError(
            f"of {len(models)} models, number {', '.join(numbers_without_place)} does not say where it was identified; "
            "record with --place X Y Z, and identify again"
        )
    places_m = np.array([model.place_m for model in models], dtype=np.float64)
    distances_m = np.linalg.norm(places_m[:, None] - places_m[None], axis=2) + np.eye(len(places_m))
    first_index, second_index = np.unravel_index(int(distances_m.argmin()), distances_m.shape)
    if distances_m[first_index, second_index] < SAME_PLACE_M:
        raise WorkspaceError(
            f"models {first_index + 1} and {second_index + 1} were identified at the same place; give one of them"
        )
