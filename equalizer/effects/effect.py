"""Definition of a physical effect, for simulation and diagnosis: its equation, parameters, where and how it acts.

An effect acts in one of five ways: it changes the linear structure, adds a force that depends on the motion at a
driven axis or within a joint, changes the command before it becomes a force, or changes the response after it was
sensed.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal
from weakref import WeakValueDictionary

from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.law import Law
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

Values = Mapping[str, float]
"""By parameter name, SI."""

STEPS = 4
"""Per sample, where a force depends on the motion or a command moves between samples."""

ALL_SITES = -1
"""Stands for the site where starting values are asked for all axes or channels together."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number that a fit may move between `lower` and `upper`."""

    name: str
    lower: float
    upper: float
    none: float | None
    """Value at which the effect vanishes, if all parameters that have such a value are at it; None: does not count."""
    scale: Literal["log", "linear", "signed"] = "log"
    """signed: either sign, and the size is not known beforehand; a fit moves it by a share of its start."""
    step: float = 0.01
    """How far a fit moves it to see what it does: relative, but in its own unit on a linear scale."""
    fixed: bool = False
    """Read off the recording by its starting value; a fit does not move it."""


@dataclass(frozen=True, slots=True)
class Structure:
    """Another linear model: masses, dampers, springs, couplings."""

    change: Callable[[MechanicalModel, int, Values], MechanicalModel]
    """Model, driven axis, values."""


@dataclass(frozen=True, slots=True)
class AxisForce:
    """A force along a driven axis, from its motion."""

    law: Any
    """Compiled: law(numbers, memory, at) gives newtons; `equalizer.effects.simulation.instant` says what `at` holds."""
    pack: Callable[[MechanicalModel, int, Values], FloatArray]
    """The law's `numbers` from model, axis and values."""
    memory: int = 0
    """How many numbers the law keeps between instants; they start at zero."""
    steps: int = STEPS
    """At least so many per sample."""
    acceleration: bool = False
    """The law asks for accelerations, which are not computed otherwise."""
    sees: bool = False
    """The law asks for the motion of all driven axes and for the commands, which it is not shown otherwise."""


@dataclass(frozen=True, slots=True)
class JointForce:
    """A force between two bodies, or within one that the model takes for stiff, from how they move to each other."""

    change: Callable[[MechanicalModel, int, Values], tuple[MechanicalModel, FloatArray]]
    """The structure with the joint in it, whose further coordinates come last; and the direction (n,) in its
    coordinates along which the joint moves and its force acts."""
    law: Any
    pack: Callable[[MechanicalModel, int, Values], FloatArray]
    """Of the model before the change."""
    memory: int = 0
    steps: int = STEPS
    acceleration: bool = False


@dataclass(frozen=True, slots=True)
class OnCommand:
    """What becomes of one channel of the command."""

    change: Callable[[FloatArray, float, Values], FloatArray]
    """Samples (n,), the seconds between them, values. A sample is the mean over its time."""
    fine: bool = False
    """It moves between samples, so that it must be followed more finely than they come."""
    at_end: Callable[[FloatArray, float, Values], FloatArray] | None = None
    """The force at the end of each step from the same means, where it moves between samples; else `change` gives
    both."""
    of_all: Callable[[FloatArray, int, float, Values], tuple[FloatArray, FloatArray]] | None = None
    """Instead of the above where it depends on other channels too: samples (n, m), channel, seconds, values; returns
    the force (n,), mean over each step and at its end."""


@dataclass(frozen=True, slots=True)
class OnResponse:
    """What becomes of the response."""

    change: Callable[[FloatArray, float, tuple[int, ...], Values], FloatArray]
    """Samples (n, p), sample rate, the affected channels, values."""
    after_filter: bool = True
    """Comes after the sensor's own low pass."""
    stage: int = 0
    """Orders those on the same side of the low pass: alignment, range, what is added, numbers, clock."""
    shared: bool = False
    """It cannot affect a single channel alone."""
    of_whole: bool = False
    """It depends on the recording's length, which must therefore be known for an excerpt."""
    bandwidth_hz: Callable[[float, Values], float] | None = None
    """Of its channels' low pass, from what the model says it is; 0 = none."""
    on_position: Callable[[FloatArray, float, Values], FloatArray] | None = None
    """What becomes of the positions (n, p) where the same clock reads them: sample rate, values."""
    given: Callable[[FloatArray, FloatArray, FloatArray, tuple[int, ...], Values], FloatArray] | None = None
    """For a random effect, the response conditioned on a measurement: samples (n, p), measured (n, p), its noise (p,),
    channels, values. Without a measurement `change` draws a realisation."""
    given_position: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray] | None = None
    """The same of the position: response before and after, position (n, p), as measured (n, p)."""


Acts = Structure | AxisForce | JointForce | OnCommand | OnResponse


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Effect:
    """A catalogue entry. Its name, place, units and reported parameters stand in the vocabulary."""

    name: str
    equation: str
    source: str
    signature: str
    """How the effect shows in the data, as the end of a sentence that names it."""
    parameters: tuple[Parameter, ...]
    acts: Acts
    starts: Callable[[Evidence, int], tuple[Values, ...]]
    """Values worth trying at an axis or channel, the likeliest first; none where the data speak against it."""
    sites: tuple[Literal["one", "all", "each"], ...] = ("one",)
    """One axis or channel; all with the same numbers; all, each with its own."""
    simpler: tuple[str, ...] = ()
    """Effects that it contains as a special case."""
    report: Callable[[Values], Values] = dict
    """The vocabulary's parameters from the fitted ones, where those are more than a reader needs."""
    alike: Callable[[Values], tuple[Values, ...]] = lambda values: ()
    """Other values with almost the same effect, at which a fit may have ended by mistake."""
    law: Law | None = None
    """Of an effect that has no name of its own: its formula."""
    of_time: bool = False
    """It depends on time within a recording, or on rare events: no excerpt represents the whole recording."""
    with_conditions: Callable[[FloatArray, float], Acts] | None = None
    """Of an effect that depends on recorded conditions: how it acts under these, (n, q) at a rate in Hz, from a
    simulation's first sample on."""

    def __post_init__(self) -> None:
        _living[id(self)] = self


_living: WeakValueDictionary[int, Effect] = WeakValueDictionary()


def living_effects() -> dict[int, Effect]:
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
