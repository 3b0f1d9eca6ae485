"""Definition of a physical effect, for simulation and diagnosis: its equation, parameters, where and how it acts.

An effect acts in one of five ways: it changes the linear structure, adds a force that depends on the motion at a
driven axis or within a joint, changes the command before it becomes a force, or changes the response after it was
sensed.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal
from weakref import WeakValueDictionary

import numpy as np

from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.law import Law
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

Values = Mapping[str, float]
"""Values by parameter name, in SI units."""

STEPS = 4
"""Default number of integration steps per sample, where a force depends on the motion or a command changes between
samples."""

ALL_SITES = -1
"""Placeholder for the site when starting values are asked for all axes or channels together."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number that a fit may move between `lower` and `upper`."""

    name: str
    lower: float
    upper: float
    none: float | None
    """Value at which the effect vanishes, provided that all parameters with such a value are at theirs; None: this
    parameter does not matter for that."""
    scale: Literal["log", "linear", "signed"] = "log"
    """signed: of either sign, order of magnitude unknown; a fit varies it by a share of its starting value."""
    step: float = 0.01
    """Step of a finite difference in a fit: relative; on a linear scale, in the parameter's own unit."""
    fixed: bool = False
    """The starting value is read off the recording, and a fit does not change it."""


@dataclass(frozen=True, slots=True)
class Structure:
    """Changes the linear model: masses, dampers, springs, couplings."""

    change: Callable[[MechanicalModel, int, Values], MechanicalModel]
    """From model, index of the driven axis and values to the changed model."""


@dataclass(frozen=True, slots=True)
class AxisForce:
    """A force along a driven axis that depends on the motion."""

    law: Any
    """Compiled function law(parameters, memory, at) -> force in N; `equalizer.effects.simulation.instant` documents
    `at`."""
    pack: Callable[[MechanicalModel, int, Values], FloatArray]
    """The law's `parameters` from model, axis and values."""
    memory: int = 0
    """Number of state variables that the law keeps between steps; they start at zero."""
    steps: int = STEPS
    """Least number of integration steps per sample."""
    acceleration: bool = False
    """Whether the law reads accelerations, which are computed only then."""
    sees: bool = False
    """Whether the law reads the motion of all driven axes and the commands, which are passed only then."""


@dataclass(frozen=True, slots=True)
class JointForce:
    """A force between two bodies, or within a body that the model takes as rigid, that depends on their relative
    motion."""

    change: Callable[[MechanicalModel, int, Values], tuple[MechanicalModel, FloatArray]]
    """The structure with the joint in it (its additional coordinates come last), and the direction (n,) in these
    coordinates along which the joint moves and its force acts."""
    law: Any
    pack: Callable[[MechanicalModel, int, Values], FloatArray]
    """The law's `parameters`; the model is that before `change`."""
    memory: int = 0
    steps: int = STEPS
    acceleration: bool = False


def pack_values(*names: str) -> Callable[[MechanicalModel, int, Values], FloatArray]:
    """A `pack` of the values themselves, in this order."""
    return lambda model, axis, values: np.array([values[name] for name in names])


@dataclass(frozen=True, slots=True)
class OnCommand:
    """Changes one channel of the command."""

    change: Callable[[FloatArray, float, Values], FloatArray]
    """Arguments: samples (n,), sample period in seconds, values. A sample is the mean over its period."""
    fine: bool = False
    """Whether the force changes between samples, so that it is computed in several steps per sample."""
    at_end: Callable[[FloatArray, float, Values], FloatArray] | None = None
    """The force at the end of each step, computed from the same means, where it changes between samples; None: `change`
    gives both."""
    of_all: Callable[[FloatArray, int, float, Values], tuple[FloatArray, FloatArray]] | None = None
    """Used instead of `change` and `at_end` where the force depends on other channels too. Arguments: samples (n, m),
    channel, sample period in seconds, values. Returns two arrays (n,): mean over each step, and value at its end."""


@dataclass(frozen=True, slots=True)
class OnResponse:
    """Changes the response."""

    change: Callable[[FloatArray, float, tuple[int, ...], Values], FloatArray]
    """Arguments: samples (n, p), sample rate in Hz, indices of the affected channels, values."""
    stage: int = 0
    """Order among the effects, all after the low pass: alignment, range, added signals, number format, clock."""
    of_whole: bool = False
    """Whether it depends on the recording's length, which must then be given for an excerpt."""
    bandwidth_hz: Callable[[float, Values], float] | None = None
    """Bandwidth of the channels' low pass in Hz, from the model's bandwidth and the values; 0 = no low pass."""
    on_position: Callable[[FloatArray, float, Values], FloatArray] | None = None
    """Changes the positions (n, p) where they are read by the same clock. Arguments: samples, sample rate in Hz,
    values."""
    given: Callable[[FloatArray, FloatArray, FloatArray, tuple[int, ...], Values], FloatArray] | None = None
    """For a random effect, the response conditioned on a measurement: samples (n, p), measured (n, p), its noise (p,),
    channels, values. Without a measurement `change` draws a realisation."""
    given_position: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray] | None = None
    """Likewise for the position. Arguments: response before and after, position (n, p), measured position (n, p)."""


Acts = Structure | AxisForce | JointForce | OnCommand | OnResponse


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Effect:
    """A catalogue entry. Its name, place, units and reported parameters are listed in
    `equalizer.plant.effect_vocabulary`."""

    name: str
    equation: str
    source: str
    signature: str
    """How the effect shows in the data, as the end of a sentence that names it."""
    parameters: tuple[Parameter, ...]
    acts: Acts
    starts: Callable[[Evidence, int], tuple[Values, ...]]
    """Starting values at an axis or channel, the likeliest first; empty where the data speak against the effect."""
    sites: tuple[Literal["one", "all", "each"], ...] = ("one",)
    """At how many places it can act: one axis or channel; all with the same parameters; all, each with its own."""
    simpler: tuple[str, ...] = ()
    """Names of effects that it contains as special cases."""
    report: Callable[[Values], Values] = dict
    """The reported parameters of the vocabulary from the fitted ones, where these are more than are reported."""
    alike: Callable[[Values], tuple[Values, ...]] = lambda values: ()
    """Other values with almost the same effect, at which a fit may have converged by mistake."""
    law: Law | None = None
    """Formula of an effect that has no name in the vocabulary."""
    of_time: bool = False
    """Depends on time within a recording, or on rare events: no excerpt represents the whole recording."""
    with_conditions: Callable[[FloatArray, float], Acts] | None = None
    """For an effect that depends on recorded conditions: the effect under given conditions (n, q), sampled at a rate in
    Hz from a simulation's first sample on."""

    def __post_init__(self) -> None:
        _living[id(self)] = self


_living: WeakValueDictionary[int, Effect] = WeakValueDictionary()


def effects_by_address() -> dict[int, Effect]:
    """All effects that exist, by address (`id`): those of the catalogue and those of discovered laws.

    Effects hold functions, which cannot be sent to another process; a forked process has them at the same addresses.
    """
    held = [reference() for reference in _living.valuerefs()]
    return {id(effect): effect for effect in held if effect is not None}


@dataclass(frozen=True, slots=True)
class PlacedEffect:
    """An effect with its values and the axes or channels it acts on, all with the same values."""

    effect: Effect
    sites: tuple[int, ...]
    values: Values
