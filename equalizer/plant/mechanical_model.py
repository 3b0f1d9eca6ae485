"""A mechanical model of a device: masses, dampers and springs between a driving force and a sensor.

    M a + D v + K q = B u,     y = C q, C v or C a, by `quantity`

q (n,) are the coordinates, v and a their first and second time derivatives, u (m,) the forces, y (p,) the responses.
Limits of sensor and actuator, and effects of `effect_vocabulary`, are stated in addition. `mechanical_model_toml` reads
and writes the model as text; `effects.simulation` simulates it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Any

import numpy as np

from equalizer.laws.law import Law
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW, EFFECTS_BY_NAME
from equalizer.signals.listed_problems import ListedProblemsError
from equalizer.signals.signal import FloatArray
from equalizer.signals.summary import Summary, SummaryDisplay
from equalizer.signals.unit_system import LINEAR, ROTATIONAL, UnitSystem, determine_unit_system

DERIVATIVE_OF_QUANTITY = {
    "position": 0, "displacement": 0, "angle": 0, "velocity": 1, "speed": 1, "acceleration": 2,
    "angular velocity": 1, "angular speed": 1, "angular acceleration": 2, "voltage": 0,
}  # fmt: skip
"""Order of the coordinates' time derivative that a response measures, by the response's quantity."""


class MechanicalModelError(ListedProblemsError):
    """A model with inconsistent values, or a text that is not in the format. `problems`: a sentence for each."""


@dataclass(frozen=True, slots=True)
class SensorLimits:
    """Low pass and measuring range of the sensor; 0 = none."""

    bandwidth_hz: float = 0.0
    """Bandwidth f of a first-order low pass per channel, at the sample rate: y += (1 - exp(-2 pi f / rate)) (x - y)."""
    range: float = 0.0
    """Largest magnitude that the sensor measures, in the response's unit."""


@dataclass(frozen=True, slots=True)
class ActuatorLimits:
    """Delay, first-order low pass and largest force of the actuator; 0 = none."""

    delay_s: float = 0.0
    """Delay (s) from a command to its force."""
    bandwidth_hz: float = 0.0
    """Bandwidth (Hz) of a first-order low pass per channel."""
    limit: float = 0.0
    """Largest force (N) or torque (N m) per channel; in the command's unit where that is another."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Calibration uncertainty of mass, damping and stiffness at each driven axis, as a standard deviation; None = not
    stated. Units in rotational models: kg m^2, N m s/rad, N m/rad."""

    mass_kg: float | None = None
    damping_n_s_per_m: float | None = None
    stiffness_n_per_m: float | None = None
    modes: float | None = None
    """Relative standard deviation of modal frequencies and masses (1 = 100 %)."""


@dataclass(frozen=True, slots=True)
class ModelEffect:
    """An effect of the vocabulary with the values of its parameters."""

    kind: str
    """Name in the vocabulary, or DISCOVERED_LAW."""
    axis: str | None
    """Axis or channel name of the command or response; None where all share the effect."""
    parameters: Mapping[str, float]
    """Values by name, in the units of the vocabulary."""
    law: Law | None = None
    """Formula of a discovered law, which contains its parameters."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class MechanicalModel(SummaryDisplay):
    """A mechanical model. Values are in the units of `system`; the SI units are stated below. Raises
    MechanicalModelError for inconsistent values."""

    name: str
    """Name of the device."""
    quantity: str
    """Quantity of the response; a key of DERIVATIVE_OF_QUANTITY."""
    mass: FloatArray
    """(n, n), kg or kg m^2; symmetric and positive definite."""
    damping: FloatArray
    """(n, n), N s/m or N m s/rad"""
    stiffness: FloatArray
    """(n, n), N/m or N m/rad"""
    input: FloatArray
    """(n, m), B: how each command drives the coordinates."""
    output: FloatArray
    """(p, n), C; its rows also give the position where a position is recorded in addition to the response."""
    sensor: SensorLimits = SensorLimits()
    actuator: ActuatorLimits = ActuatorLimits()
    effects: tuple[ModelEffect, ...] = ()
    """Effects in addition to the linear model."""
    tolerance: Tolerance | None = None
    """Calibration uncertainty; None = not stated."""
    rotational: bool = False
    """Whether the coordinates are angles and the commands torques."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Origin of the model, as TOML values."""
    units: UnitSystem | None = None
    """Units of the parameters where these are not SI, as for commands that are currents; None = SI, by `rotational`."""

    def __post_init__(self) -> None:
        """Copy the matrices as read-only double precision, and check the values. Raises MechanicalModelError."""
        for name in ("mass", "damping", "stiffness", "input", "output"):
            matrix = np.array(getattr(self, name), dtype=np.float64, ndmin=1)
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        problems = tuple(_find_problems(self))
        if problems:
            raise MechanicalModelError(problems)

    @property
    def system(self) -> UnitSystem:
        """Units of the parameters: `units` if stated, else SI, linear or rotational."""
        return self.units or (ROTATIONAL if self.rotational else LINEAR)

    @property
    def coordinates(self) -> int:
        """Number of coordinates, n."""
        return int(self.mass.shape[0])

    @property
    def inputs(self) -> int:
        """Number of commands, m."""
        return int(self.input.shape[1])

    @property
    def outputs(self) -> int:
        """Number of responses, p."""
        return int(self.output.shape[0])

    def summary(self) -> Summary:
        """Summarise the numbers of coordinates, commands and responses, and the effects, for printing."""
        return Summary(
            f"Mechanical model {self.name}",
            (
                ("coordinates", str(len(self.mass))),
                ("commands", str(self.input.shape[1])),
                ("responses", f"{len(self.output)}, {self.quantity}"),
                ("effects", ", ".join(effect.kind for effect in self.effects) or "none"),
            ),
        )


def adopt_recording_units(
    model: MechanicalModel, commands: Sequence[str], responses: Sequence[str], time: str = "s"
) -> MechanicalModel:
    """Return the model with the unit system of its recordings; unchanged if it states units, if those of the
    recordings are SI, or if its input or output matrix converts units (has entries other than 0, 1 and -1). commands,
    responses: units of the recordings' channels; time: unit of their time, "sample" where no time is known."""
    has_unit_entries = all(np.isin(np.abs(matrix), (0.0, 1.0)).all() for matrix in (model.input, model.output))
    system = determine_unit_system(commands, responses, time)
    if model.units is not None or not has_unit_entries or system.rotational is not None:
        return model
    return replace(model, units=system)


def suggest_word(word: str, allowed: tuple[str, ...]) -> str:
    """Suggest the most similar of the allowed words, as text to append to a message; empty if none is similar."""
    similar_words = get_close_matches(word[:60], allowed, n=1)  # the comparison of very long words takes minutes
    return f" (did you mean '{similar_words[0]}'?)" if similar_words else ""


def _find_problems(model: MechanicalModel) -> Iterator[str]:
    """Find the inconsistent values of the model. Yields a sentence for each."""
    if model.quantity not in DERIVATIVE_OF_QUANTITY:
        yield f"model.quantity is '{model.quantity}'; allowed are {', '.join(DERIVATIVE_OF_QUANTITY)}"
    yield from _find_matrix_problems(model)
    for section, section_values in (
        ("sensor", model.sensor),
        ("actuator", model.actuator),
        ("tolerance", model.tolerance),
    ):
        for name in () if section_values is None else section_values.__dataclass_fields__:
            value = getattr(section_values, name)
            if value is not None and not (np.isfinite(value) and value >= 0):
                yield f"{section}.{name} is {value}; it must be a number that is not negative"
    for number, effect in enumerate(model.effects, start=1):
        for problem in find_effect_problems(effect):
            yield f"effect {number}: {problem}"


def _find_matrix_problems(model: MechanicalModel) -> Iterator[str]:
    """Find shapes that do not agree with the mass matrix, values that are not finite, and an invalid mass matrix."""
    n = model.mass.shape[0]
    shapes = {
        "mass": (n, n), "damping": (n, n), "stiffness": (n, n),
        "input": (n, *model.input.shape[1:2]), "output": (model.output.shape[0], n),
    }  # fmt: skip
    is_valid = True
    for name, shape in shapes.items():
        matrix: FloatArray = getattr(model, name)
        if matrix.ndim != 2 or matrix.shape != shape or 0 in matrix.shape:
            expected_shape = {"input": f"({n}, inputs)", "output": f"(outputs, {n})"}.get(name, f"({n}, {n})")
            yield f"model.{name} has shape {matrix.shape}, but must have {expected_shape}: mass is {n} rows high"
            is_valid = False
        elif not np.isfinite(matrix).all():
            yield f"model.{name} holds values that are not finite numbers"
            is_valid = False
    if is_valid:
        yield from _find_mass_problems(model.mass)


def _find_mass_problems(mass: FloatArray) -> Iterator[str]:
    """Find asymmetry of the mass matrix (n, n), or an eigenvalue that is not positive."""
    # Most matrices are exactly symmetric, and the exact comparison takes a tenth of the time of the approximate one.
    is_exactly_symmetric = np.array_equal(mass, mass.T)
    if not is_exactly_symmetric and not np.allclose(mass, mass.T, rtol=1e-6, atol=1e-9 * float(np.abs(mass).max())):
        yield "model.mass is not symmetric; inertia acts alike both ways, so m[i][j] must equal m[j][i]"
    elif (lowest_eigenvalue := float(np.linalg.eigvalsh(mass)[0])) <= 0:
        yield (
            f"model.mass is not positive definite (its lowest eigenvalue is {lowest_eigenvalue:.3g}); "
            "every motion needs a mass"
        )


def find_effect_problems(effect: ModelEffect) -> Iterator[str]:
    """Find deviations of an effect from the vocabulary: unknown or missing names, values that are not finite. Yields a
    sentence for each."""
    if effect.kind == DISCOVERED_LAW:
        yield from _find_law_problems(effect)
        return
    vocabulary_entry = EFFECTS_BY_NAME.get(effect.kind)
    if vocabulary_entry is None:
        names = (*EFFECTS_BY_NAME, DISCOVERED_LAW)
        yield f"unknown kind '{effect.kind}'{suggest_word(effect.kind, names)}; allowed are {', '.join(names)}"
        return
    names = tuple(parameter.name for parameter in vocabulary_entry.parameters)
    for name, value in effect.parameters.items():
        if name not in names:
            yield f"{effect.kind} has no parameter '{name}'{suggest_word(name, names)}; allowed are {', '.join(names)}"
        elif not np.isfinite(value):
            yield f"{effect.kind}.{name} is {value}; it must be a finite number"
    missing_parameters = [
        f"{definition.name} ({definition.unit})"
        for definition in vocabulary_entry.parameters
        if not (definition.optional or definition.name in effect.parameters)
    ]
    if missing_parameters:
        yield f"{effect.kind} lacks {', '.join(missing_parameters)}"


def _find_law_problems(effect: ModelEffect) -> Iterator[str]:
    """Find a missing law of a discovered effect, or parameters outside its expression."""
    if effect.law is None:
        yield f"{effect.kind} lacks expression, acts_on or axis"
    if effect.parameters:
        yield f"{effect.kind} has its parameters in its expression; it also gives {', '.join(effect.parameters)}"
