"""Faults of a mechanism: additional forces along the measured motion, each undone by subtracting it from the command.
`rank_faults` fits them. Two are reported with other parameters than those of the subtracted force: end stops at both
ends by the position of the upper one alone, cogging by the phase of the opposite force.

With x the measured position, q its distance from the middle of the travel, v the velocity, a the acceleration and
sigma = tanh(v / width):

    added_mass             M a               hardening_stiffness    k3 q^3
    viscous_damping        d v               coulomb_friction       F sigma
    quadratic_damping      c v |v|           asymmetric_friction    F+ max(sigma, 0) + F- min(sigma, 0)
    added_stiffness        k q               presliding_hysteresis  F z (Dahl's law, `compute_bristle_deflection`)
    end_stop               k max(|q| - q0, 0) sgn q                cogging   A sin(2 pi x / pitch + phase)
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.laws.friction_laws import LEAST_WIDTH_SHARE
from analysis.diagnosis.balance.laws.law import smooth_sign
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.contrast.fault import Fault, ParametersOf, Undo, Variant, scale_parameter
from analysis.diagnosis.contrast.recording_part import Part
from equalizer.effects.simulation.dry_friction_kernel import compute_bristle_deflection
from equalizer.signals.signal import FloatArray

ForceShape = Callable[[Motion], FloatArray]
"""Maps a part's motion to the force (n,) of a fault of size 1."""
MotionLookup = Callable[[Part], Motion]
"""Maps a part to its measured motion. In the functions below, m is a motion and s the sizes of a variant."""
WIDTH_FACTORS = (1.0, 3.0, 8.0, 20.0)
"""Tried widths of the smoothed sign of dry friction, relative to the narrowest. Chosen by hand."""
PRESLIDING_SHARES = tuple(np.geomspace(0.003, 0.3, 7).tolist())
"""Tried presliding distances, relative to the travel. Chosen by hand."""
COGGING_PERIOD_COUNTS = tuple(np.arange(2.0, 40.0, 0.35).tolist())
"""Tried numbers of periods of a cogging force within the travel, or within a turn of a shaft that turns farther. Chosen
by hand."""
STOP_SHARES = tuple(np.arange(0.05, 0.5, 0.05).tolist())
"""Tried distances of an end stop from the middle of the travel, relative to the travel. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """A driven axis with the middle of its measured motion, in m or rad."""

    index: int
    """Index of the axis in the command."""
    name: str
    get_motion: MotionLookup
    """Returns the motion of a part."""
    channel: int
    """Index of the channel of the motion along this axis."""
    middle: float
    """Middle of the travel."""

    def make_fault(self, effect: str, variants: Sequence[Variant], simpler: tuple[str, ...] = ()) -> Fault:
        """Make a fault of the mechanism on this axis. simpler: faults that it contains as special cases."""
        return Fault(effect, "mechanism", self.name, self.index, tuple(variants), simpler)

    def make_proportional_fault(
        self, effect: str, force_shape: ForceShape, parameter_name: str, lower_bound: float = 0.0
    ) -> Fault:
        """Make a fault whose force is a single parameter times `force_shape`. parameter_name, lower_bound: of the
        parameter."""
        return self.make_fault(
            effect, [Variant((self.make_undo(force_shape),), scale_parameter(parameter_name), lower_bound=lower_bound)]
        )

    def make_undo(self, force_shape: ForceShape) -> Undo:
        """Make the function that subtracts `force_shape` from the command of this axis."""

        def undo(part: Part) -> Part:
            command = part.command.copy()
            command[:, self.index] -= force_shape(self.get_motion(part))
            return replace(part, command=command)

        return undo

    def compute_position(self, motion: Motion) -> FloatArray:
        """Compute the position (n,) from the middle of the travel, m or rad."""
        return np.asarray(motion.position[:, self.channel] - self.middle)

    def get_velocity(self, motion: Motion) -> FloatArray:
        """Return the velocity (n,) along the channel of this axis, m/s or rad/s."""
        return motion.velocity[:, self.channel]


def make_mechanism_faults(
    axis_index: int, name: str, motions: Sequence[Motion], get_motion: MotionLookup, is_rotational: bool
) -> Iterator[Fault]:
    """Make all faults of the mechanism along an axis; its motion is the channel of the same index, or the last channel
    where there are fewer channels than axes. motions: of all compared parts, whose range the grids span. get_motion:
    maps a part to its motion. is_rotational: whether the axis turns; pitches of cogging are then at most half a
    turn."""
    channel = min(axis_index, len(motions[0].channels) - 1)
    position = np.concatenate([motion.position[:, channel] for motion in motions])
    velocity = np.concatenate([motion.velocity[:, channel] for motion in motions])
    # The least values keep divisions by the travel and by the width finite where nothing moves.
    lower_end, travel = float(position.min()), max(float(np.ptp(position)), 1e-300)
    longest_pitch = min(travel, 2 * np.pi) if is_rotational else travel
    least_width = max(LEAST_WIDTH_SHARE * float(np.sqrt(np.mean(velocity**2))), 1e-300)
    axis = _Axis(axis_index, name, get_motion, channel, lower_end + 0.5 * travel)
    yield axis.make_proportional_fault("added_mass", lambda m: m.acceleration[:, channel], "mass")
    yield axis.make_proportional_fault("viscous_damping", axis.get_velocity, "damping")
    yield axis.make_proportional_fault(
        "quadratic_damping", lambda m: axis.get_velocity(m) * np.abs(axis.get_velocity(m)), "coefficient"
    )
    yield axis.make_proportional_fault("added_stiffness", axis.compute_position, "stiffness", lower_bound=-np.inf)
    yield axis.make_proportional_fault(
        "hardening_stiffness", lambda m: axis.compute_position(m) ** 3, "k3", lower_bound=-np.inf
    )
    yield axis.make_fault(
        "coulomb_friction", [_make_coulomb_variant(axis, width_factor * least_width) for width_factor in WIDTH_FACTORS]
    )
    yield axis.make_fault(
        "asymmetric_friction",
        [_make_asymmetric_variant(axis, width_factor * least_width) for width_factor in WIDTH_FACTORS],
        ("coulomb_friction",),
    )
    yield axis.make_fault(
        "presliding_hysteresis",
        [_make_presliding_variant(axis, length_share * travel) for length_share in PRESLIDING_SHARES],
        ("coulomb_friction",),
    )
    yield axis.make_fault(
        "cogging", [_make_cogging_variant(axis, longest_pitch / period_count) for period_count in COGGING_PERIOD_COUNTS]
    )
    yield axis.make_fault(
        "end_stop", [stop for stop_share in STOP_SHARES for stop in _make_stop_variants(axis, stop_share * travel)]
    )


def _make_coulomb_variant(axis: _Axis, speed_width: float) -> Variant:
    """Make Coulomb friction with a sign smoothed over `speed_width` (m/s or rad/s)."""
    return Variant(
        (axis.make_undo(lambda m: smooth_sign(axis.get_velocity(m), speed_width)),),
        scale_parameter("level"),
        lower_bound=0.0,
    )


def _make_asymmetric_variant(axis: _Axis, speed_width: float) -> Variant:
    """Make Coulomb friction with one level per direction; speed_width: as in `_make_coulomb_variant`."""
    undo = (
        axis.make_undo(lambda m: np.maximum(smooth_sign(axis.get_velocity(m), speed_width), 0.0)),
        axis.make_undo(lambda m: np.minimum(smooth_sign(axis.get_velocity(m), speed_width), 0.0)),
    )
    return Variant(undo, lambda s: {"level_positive": float(s[0]), "level_negative": float(s[1])}, lower_bound=0.0)


def _make_presliding_variant(axis: _Axis, distance: float) -> Variant:
    """Make Dahl's friction with the presliding distance `distance` (m or rad)."""
    parameters_of: ParametersOf = lambda s: {"level": float(s[0]), "stiffness": float(s[0]) / distance}  # noqa: E731
    return Variant(
        (axis.make_undo(lambda m: compute_bristle_deflection(m.position[:, axis.channel], distance)),),
        parameters_of,
        lower_bound=0.0,
    )


def _make_cogging_variant(axis: _Axis, pitch: float) -> Variant:
    """Make cogging with the period `pitch` (m or rad); its two sizes are those of a sine and a cosine."""
    undo = (
        axis.make_undo(lambda m: np.sin(2 * np.pi * m.position[:, axis.channel] / pitch)),
        axis.make_undo(lambda m: np.cos(2 * np.pi * m.position[:, axis.channel] / pitch)),
    )
    # Opposite signs: the force in the catalogue acts on the moving mass, and the command must balance it.
    return Variant(undo, lambda s: {
        "amplitude": float(np.hypot(*s)), "pitch": pitch, "phase": float(np.arctan2(-s[1], -s[0])),
    })  # fmt: skip


def _make_stop_variants(axis: _Axis, stop_distance: float) -> Iterator[Variant]:
    """Make end stops at both ends of the travel, and at each end alone. stop_distance: distance from its middle, m or
    rad."""
    two_sided = axis.make_undo(
        lambda m: np.sign(axis.compute_position(m)) * np.maximum(np.abs(axis.compute_position(m)) - stop_distance, 0.0)
    )
    yield Variant((two_sided,), _make_stop_parameters(axis.middle + stop_distance, 1.0), lower_bound=0.0)
    for direction in (1.0, -1.0):
        yield _make_stop_variant(axis, direction, stop_distance)


def _make_stop_variant(axis: _Axis, direction: float, stop_distance: float) -> Variant:
    """Make an end stop at one end of the travel. direction: 1 (upper end) or -1 (lower end)."""
    undo = axis.make_undo(lambda m: direction * np.maximum(direction * axis.compute_position(m) - stop_distance, 0.0))
    return Variant((undo,), _make_stop_parameters(axis.middle + direction * stop_distance, direction), lower_bound=0.0)


def _make_stop_parameters(position: float, direction: float) -> ParametersOf:
    """Make the map from the size of an end stop to its parameters: position (m or rad), stiffness, and side
    (`direction`, 1 or -1) only where the sign of the position does not imply it."""
    direction_parameter = {} if direction * position > 0 else {"side": direction}
    return lambda s: {"position": position, "stiffness": float(s[0]), **direction_parameter}
