"""Data types of a physical effect for simulation and diagnosis: equation, source, parameters, place and action.

An effect acts in one of five ways: it changes the linear structure (`Structure`), adds a motion-dependent force at a
driven axis (`AxisForce`) or within a joint (`JointForce`), changes the command before it becomes a force (`OnCommand`),
or changes the sensed response (`OnResponse`). Sizes: n samples or coordinates, m commands, p response channels. SI
units; on rotational axes N stands for N m and m for rad. `catalogue` lists the effects, `placing` binds them to axes,
and `simulation` evaluates them.
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
"""Default number of integration steps per sample (chosen), where a force depends on the motion or a command changes
between samples."""

ALL_SITES = -1
"""Placeholder for the index of a site when starting values are asked for all axes or channels together."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of an effect that a fit varies between `lower` and `upper`, in SI units."""

    name: str
    """Key in `Values`."""
    lower: float
    upper: float
    none: float | None
    """Value at which the effect vanishes; where several parameters have such a value, all of them must be at it. None:
    the effect does not vanish by this parameter."""
    scale: Literal["log", "linear", "signed"] = "log"
    """How a fit varies the parameter. log: positive, by its logarithm; linear: in its own unit; signed: of either sign
    and unknown order of magnitude, by a share of its starting value."""
    step: float = 0.01
    """Step of a finite difference in a fit: relative; on a linear scale, in the parameter's own unit."""
    fixed: bool = False
    """Whether a fit keeps the starting value, which is determined from the recording directly."""


@dataclass(frozen=True, slots=True)
class Structure:
    """Action that changes the linear model: masses, dampers, springs, couplings."""

    change: Callable[[MechanicalModel, int, Values], MechanicalModel]
    """Arguments: model, index of the driven axis, values. Returns the changed model."""


@dataclass(frozen=True, slots=True)
class AxisForce:
    """Action that adds a force along a driven axis that depends on the motion."""

    law: Any
    """Compiled function law(parameters, memory, step_motion) -> mean force in N over a step;
    `equalizer.effects.simulation.instant` documents `step_motion`."""
    pack: Callable[[MechanicalModel, int, Values], FloatArray]
    """Arguments: model, index of the driven axis, values. Returns the law's `parameters`, a flat array."""
    memory: int = 0
    """Number of state variables that the law keeps between steps; they start at zero."""
    steps: int = STEPS
    """Least number of integration steps per sample."""
    acceleration: bool = False
    """Whether the law reads accelerations, which are computed only then."""
    reads_all_axes: bool = False
    """Whether the law reads the motion of all driven axes and the commands, which are passed only then."""


@dataclass(frozen=True, slots=True)
class JointForce:
    """Action that adds a force between two bodies, or within a body that the model takes as rigid, that depends on
    their relative motion."""

    change: Callable[[MechanicalModel, int, Values], tuple[MechanicalModel, FloatArray]]
    """Arguments as in `Structure`. Returns the model with the joint in it (its additional coordinates come last), and
    the direction (n,) in these coordinates along which the joint moves and its force acts."""
    law: Any
    """Compiled function as in `AxisForce`; `memory`, `steps` and `acceleration` have the meaning that they have
    there."""
    pack: Callable[[MechanicalModel, int, Values], FloatArray]
    """The law's `parameters`; the model is that before `change`."""
    memory: int = 0
    steps: int = STEPS
    acceleration: bool = False


def pack_values(*names: str) -> Callable[[MechanicalModel, int, Values], FloatArray]:
    """Make a `pack` function whose array (k,) is the values of these parameters in this order."""
    return lambda model, axis, values: np.array([values[name] for name in names])


@dataclass(frozen=True, slots=True)
class OnCommand:
    """Action that changes one channel of the command before it becomes a force."""

    change: Callable[[FloatArray, float, Values], FloatArray]
    """Arguments: the command (n,), one value per integration step; length of a step in seconds; values. It is called
    with the means over the steps and, where `at_end` is None, also with the values at their ends."""
    fine: bool = False
    """Whether the force changes between samples, so that it is computed in several steps per sample."""
    at_end: Callable[[FloatArray, float, Values], FloatArray] | None = None
    """The force at the end of each step, computed from the same means; None: `change` gives both."""
    of_all: Callable[[FloatArray, int, float, Values], tuple[FloatArray, FloatArray]] | None = None
    """Used instead of `change` and `at_end` where the force depends on other channels too. Arguments: commands (n, m)
    as for `change`, channel, length of a step in seconds, values. Returns two arrays (n,): mean over each step, and
    value at its end."""


@dataclass(frozen=True, slots=True)
class OnResponse:
    """Action that changes the sensed response."""

    change: Callable[[FloatArray, float, tuple[int, ...], Values], FloatArray]
    """Arguments: samples (n, p), sample rate in Hz, indices of the affected channels, values."""
    stage: int = 0
    """Order of the effects, ascending, all after the low pass: alignment of axes (-2, -1), gain and nonlinearity (0),
    range (1), added signals (2), rounding (3), clock (4), lost samples (5)."""
    needs_full_length: bool = False
    """Whether the effect depends on the length of the recording, which must then be given for an excerpt."""
    bandwidth_hz: Callable[[float, Values], float] | None = None
    """Bandwidth of the channels' low pass in Hz, from the model's bandwidth and the values; 0 = no low pass."""
    on_position: Callable[[FloatArray, float, Values], FloatArray] | None = None
    """Changes the positions (n, p) that the same clock samples. Arguments: positions, sample rate in Hz, values. None:
    the effect leaves positions unchanged."""
    conditioned: Callable[[FloatArray, FloatArray, FloatArray, tuple[int, ...], Values], FloatArray] | None = None
    """Used instead of `change` under a measurement: the response conditioned on it. Arguments: samples (n, p), measured
    (n, p), its noise (p,), channels, values."""
    conditioned_position: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray] | None = None
    """The positions conditioned on a measurement. Arguments: response before and after the effect, position, measured
    position, (n, p) each."""


Action = Structure | AxisForce | JointForce | OnCommand | OnResponse
"""The five ways in which an effect acts."""


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Effect:
    """A catalogue entry or a discovered law. Name, place, units and reported parameters of a catalogue entry are listed
    in `equalizer.plant.effect_vocabulary`."""

    name: str
    equation: str
    """Equation in ASCII, with the names of the parameters."""
    source: str
    """Reference of the equation."""
    signature: str
    """Features of the effect in the data, as the end of a sentence that begins with its name."""
    parameters: tuple[Parameter, ...]
    action: Action
    starts: Callable[[Evidence, int], tuple[Values, ...]]
    """Arguments: evidence, index of an axis or channel (or ALL_SITES). Returns sets of starting values; empty where
    none were found, as where the data contradict the effect."""
    sites: tuple[Literal["one", "all", "each"], ...] = ("one",)
    """Where the effect can act. one: a single axis or channel; all: every one, with the same parameters; each: every
    one, with its own parameters."""
    simpler: tuple[str, ...] = ()
    """Names of effects that it contains as special cases."""
    report: Callable[[Values], Values] = dict
    """Converts fitted parameters to the reported ones of the vocabulary, where a fit has more."""
    near_equivalents: Callable[[Values], tuple[Values, ...]] = lambda values: ()
    """Other values with almost the same effect, at which a fit may have converged by mistake."""
    law: Law | None = None
    """Law of a discovered law's effect; None for an entry of the catalogue."""
    of_time: bool = False
    """Whether the effect depends on time within a recording, or on rare events, so that no excerpt represents the whole
    recording."""
    with_conditions: Callable[[FloatArray, float], Action] | None = None
    """For an effect that depends on recorded conditions: the effect under given conditions (n, q), sampled at a rate in
    Hz from a simulation's first sample on."""

    def __post_init__(self) -> None:
        """Register the effect for `list_effects_by_address`."""
        _live_effects[id(self)] = self


_live_effects: WeakValueDictionary[int, Effect] = WeakValueDictionary()
"""Effects by address; weak references, so that an unused effect is freed."""


def list_effects_by_address() -> dict[int, Effect]:
    """List all effects in this process by address (`id`).

    Effects hold functions, which cannot be pickled for another process; a forked process has them at the same
    addresses, so that the address identifies them there.
    """
    effects = [reference() for reference in _live_effects.valuerefs()]
    return {id(effect): effect for effect in effects if effect is not None}


@dataclass(frozen=True, slots=True)
class PlacedEffect:
    """An effect with its values and the axes or channels it acts on, all with the same values."""

    effect: Effect
    sites: tuple[int, ...]
    """Indices of driven axes or, for a sensor effect, of response channels."""
    values: Values
