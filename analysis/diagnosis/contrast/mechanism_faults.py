"""Faults of a mechanism: additional forces along the measured motion, each undone by subtracting it from the command.

With q the position from the middle of the travel, v the speed, a the acceleration and sigma = tanh(v / width):

    added_mass             m a               hardening_stiffness    k3 q^3
    viscous_damping        d v               coulomb_friction       F sigma
    quadratic_damping      c v |v|           asymmetric_friction    F+ max(sigma, 0) + F- min(sigma, 0)
    added_stiffness        k q               presliding_hysteresis  F z (Dahl's law, `bristle_bend`)
    end_stop               k max(|q| - q0, 0) sgn q                cogging   A sin(2 pi q / pitch + phase)
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.friction_laws import SHARP
from analysis.diagnosis.balance.law import smooth_sign
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.contrast.fault import Fault, ParametersOf, Undo, Variant, proportional_parameter
from analysis.diagnosis.contrast.part import Part
from equalizer.effects.simulation.dry_friction_kernel import bristle_bend
from equalizer.signals.signal import FloatArray

Shape = Callable[[Motion], FloatArray]
"""Maps a part's motion to the force (n,) of a fault of size 1."""
MotionOf = Callable[[Part], Motion]
"""Maps a part to its measured motion."""
WIDER = (1.0, 3.0, 8.0, 20.0)
"""Widths of the smoothed sign of dry friction, relative to the narrowest."""
GIVES = tuple(np.geomspace(0.003, 0.3, 7).tolist())
"""Presliding distances, relative to the travel."""
RIPPLES = tuple(np.arange(2.0, 40.0, 0.35).tolist())
"""Numbers of periods of a cogging force within the travel, so close that neighbours cannot be distinguished."""
STOPS = tuple(np.arange(0.05, 0.5, 0.05).tolist())
"""Distances of an end stop from the middle of the travel, relative to the travel."""


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """A driven axis with the range of its measured motion, in m or rad and s."""

    number: int
    name: str
    motion_of: MotionOf
    channel: int
    """Channel of the motion."""
    middle: float
    """Middle of the travel."""
    width: float
    """Travel, from end to end."""
    sharp: float
    """Least width of the smoothed sign, a speed."""

    def fault(self, effect: str, variants: Sequence[Variant], simpler: tuple[str, ...] = ()) -> Fault:
        """A fault of the mechanism on this axis. simpler: faults that it contains as special cases."""
        return Fault(effect, "mechanism", self.name, self.number, tuple(variants), simpler)

    def single_parameter_fault(self, effect: str, shape: Shape, number: str, lower_bound: float = 0.0) -> Fault:
        """A fault with a single parameter, the factor of `shape`. number: its name, lower_bound: its lower bound."""
        return self.fault(
            effect, [Variant((self.subtract(shape),), proportional_parameter(number), lower_bound=lower_bound)]
        )

    def subtract(self, shape: Shape) -> Undo:
        """The function that subtracts the force from the command of this axis."""

        def undo(part: Part) -> Part:
            command = part.command.copy()
            command[:, self.number] -= shape(self.motion_of(part))
            return replace(part, command=command)

        return undo

    def q(self, motion: Motion) -> FloatArray:
        """(n,): position from the middle of the travel."""
        return np.asarray(motion.position[:, self.channel] - self.middle)

    def v(self, motion: Motion) -> FloatArray:
        """(n,): velocity."""
        return motion.velocity[:, self.channel]


def mechanism_faults(
    number: int, name: str, motions: Sequence[Motion], motion_of: MotionOf, rotational: bool
) -> Iterator[Fault]:
    """All faults of the mechanism along axis `number`. motions: of all compared parts, whose range the grids span.
    motion_of: gives the motion of a part. rotational: whether the axis turns; pitches of cogging are then at most
    a turn."""
    channel = min(number, len(motions[0].channels) - 1)
    position = np.concatenate([motion.position[:, channel] for motion in motions])
    velocity = np.concatenate([motion.velocity[:, channel] for motion in motions])
    low, width = float(position.min()), max(float(np.ptp(position)), 1e-300)
    period_range = min(width, 2 * np.pi) if rotational else width
    sharp = max(SHARP * float(np.sqrt(np.mean(velocity**2))), 1e-300)
    axis = _Axis(number, name, motion_of, channel, low + 0.5 * width, width, sharp)
    yield axis.single_parameter_fault("added_mass", lambda m: m.acceleration[:, channel], "mass")
    yield axis.single_parameter_fault("viscous_damping", axis.v, "damping")
    yield axis.single_parameter_fault("quadratic_damping", lambda m: axis.v(m) * np.abs(axis.v(m)), "coefficient")
    yield axis.single_parameter_fault("added_stiffness", axis.q, "stiffness", lower_bound=-np.inf)
    yield axis.single_parameter_fault("hardening_stiffness", lambda m: axis.q(m) ** 3, "k3", lower_bound=-np.inf)
    yield axis.fault("coulomb_friction", [_coulomb_friction(axis, width_factor * sharp) for width_factor in WIDER])
    yield axis.fault(
        "asymmetric_friction",
        [_asymmetric_friction(axis, width_factor * sharp) for width_factor in WIDER],
        ("coulomb_friction",),
    )
    yield axis.fault(
        "presliding_hysteresis", [_make_presliding_variant(axis, give * width) for give in GIVES], ("coulomb_friction",)
    )
    yield axis.fault("cogging", [_make_cogging_variant(axis, period_range / count) for count in RIPPLES])
    yield axis.fault("end_stop", [stop for share in STOPS for stop in _stops(axis, share * width)])


def _coulomb_friction(axis: _Axis, speed_width: float) -> Variant:
    return Variant(
        (axis.subtract(lambda m: smooth_sign(axis.v(m), speed_width)),),
        proportional_parameter("level"),
        lower_bound=0.0,
    )


def _asymmetric_friction(axis: _Axis, speed_width: float) -> Variant:
    undo = (
        axis.subtract(lambda m: np.maximum(smooth_sign(axis.v(m), speed_width), 0.0)),
        axis.subtract(lambda m: np.minimum(smooth_sign(axis.v(m), speed_width), 0.0)),
    )
    return Variant(undo, lambda s: {"level_positive": float(s[0]), "level_negative": float(s[1])}, lower_bound=0.0)


def _make_presliding_variant(axis: _Axis, distance: float) -> Variant:
    parameters_of: ParametersOf = lambda s: {"level": float(s[0]), "stiffness": float(s[0]) / distance}  # noqa: E731
    return Variant(
        (axis.subtract(lambda m: bristle_bend(m.position[:, axis.channel], distance)),), parameters_of, lower_bound=0.0
    )


def _make_cogging_variant(axis: _Axis, pitch: float) -> Variant:
    undo = (
        axis.subtract(lambda m: np.sin(2 * np.pi * m.position[:, axis.channel] / pitch)),
        axis.subtract(lambda m: np.cos(2 * np.pi * m.position[:, axis.channel] / pitch)),
    )
    # Opposite signs: the force in the catalogue acts on the moving mass, and the command must balance it.
    return Variant(undo, lambda s: {
        "amplitude": float(np.hypot(*s)), "pitch": pitch, "phase": float(np.arctan2(-s[1], -s[0])),
    })  # fmt: skip


def _stops(axis: _Axis, reach: float) -> Iterator[Variant]:
    """End stops at both ends of the travel, and at each end alone. reach: distance from its middle, m or rad."""
    two_sided = axis.subtract(lambda m: np.sign(axis.q(m)) * np.maximum(np.abs(axis.q(m)) - reach, 0.0))
    yield Variant((two_sided,), _stop_parameters(axis.middle + reach, 1.0), lower_bound=0.0)
    for side in (1.0, -1.0):
        yield _stop(axis, side, reach)


def _stop(axis: _Axis, side: float, reach: float) -> Variant:
    undo = axis.subtract(lambda m: side * np.maximum(side * axis.q(m) - reach, 0.0))
    return Variant((undo,), _stop_parameters(axis.middle + side * reach, side), lower_bound=0.0)


def _stop_parameters(position: float, side: float) -> ParametersOf:
    """Parameters of an end stop; the side (1 or -1) is given only where the sign of the position does not imply it."""
    side_parameter = {} if side * position > 0 else {"side": side}
    return lambda s: {"position": position, "stiffness": float(s[0]), **side_parameter}
