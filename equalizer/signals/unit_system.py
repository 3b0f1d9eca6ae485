"""Unit system of a mechanical model: its units of force, length and time determine all others.

In M a + B v + K x = force, the unit of mass is force time² / length, that of damping force time / length, and that of
stiffness force / length. In SI: N s^2/m = kg, N s/m, N/m; for a rotation N m s^2/rad and so on. Where a command is a
current (A) or a plain number, the force constant of the motor is unknown and contained in every parameter: a "mass"
then has the unit A s^2/m, not kg. Used where a model, a parameter or a law is printed.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from equalizer.signals.recording import Recording

_FACTOR = re.compile(r"(kg|N|m|s)(?:\^(\d+))?$")
"""A factor of an SI unit: its symbol, and its power where it is not 1."""
_RATE_SUFFIXES = ("/s^2", "/s")
"""Ends of the unit of an acceleration and of a velocity; without them it is the unit of the position."""
FORCE_UNITS = ("N", "N m")
"""SI units of a command that is a force or a torque."""


@dataclass(frozen=True, slots=True)
class UnitSystem:
    """Units of force, length and time, from which those of mass, damping and stiffness follow. Default: SI,
    translational."""

    force: str = "N"
    """Unit of a command; ASCII."""
    length: str = "m"
    """Unit of the position; ASCII, "1" for a plain number."""
    time: str = "s"
    """Unit of time; "sample" where no time is known."""

    def express(self, unit: str) -> str:
        """Express an SI unit in this system, as the unit of the same quantity. unit: SI unit in a translational model,
        such as "N s/m" or "kg"; a unit that is not made of force, length and time is returned unchanged. Hz becomes one
        over the unit of time where that is not the second."""
        if unit == "Hz":
            return unit if self.time == "s" else f"1/{self.time}"
        numerator, _, denominator = unit.partition("/")
        powers = {"N": 0, "m": 0, "s": 0}
        for side_text, sign in ((numerator, 1), (denominator, -1)):
            for unit_text in side_text.split():
                factor_match = _FACTOR.match(unit_text)
                if factor_match is None and unit_text != "1":
                    return unit
                for name, power in _decompose_base_unit(factor_match[1]) if factor_match else ():
                    assert factor_match is not None
                    powers[name] += sign * power * int(factor_match[2] or 1)
        return self._format_unit(powers["N"], powers["m"], powers["s"])

    def _format_unit(self, force_power: int, length_power: int, time_power: int) -> str:
        """Format the product of force, length and time to these powers, such as "A s^2/m"."""
        base_powers = [(self.force, force_power), (self.length, length_power), (self.time, time_power)]
        factors = [(f"({name})" if "/" in name else name, power) for name, power in base_powers if name != "1"]
        numerator = [
            _format_power(name, power)
            for name, power in sorted(factors, key=lambda item: item[0] == self.length)
            if power > 0
        ]
        denominator = [_format_power(name, -power) for name, power in factors if power < 0]
        denominator_text = (
            f"/({' '.join(denominator)})" if len(denominator) > 1 else f"/{denominator[0]}" if denominator else ""
        )
        return f"{' '.join(numerator) or '1'}{denominator_text}"

    @property
    def has_force_unit(self) -> bool:
        """Whether commands are forces or torques; if not, every parameter contains an unknown force constant."""
        return self.force in FORCE_UNITS

    @property
    def rotational(self) -> bool | None:
        """Whether the system is rotational; None for a system outside SI."""
        return {LINEAR: False, ROTATIONAL: True}.get(self)


LINEAR, ROTATIONAL = UnitSystem(), UnitSystem("N m", "rad")
"""The SI systems of translational and rotational models."""


def determine_unit_system(commands: Sequence[str], motions: Sequence[str], time: str = "s") -> UnitSystem:
    """Determine the unit system of a recording. commands, motions: units of its commands and of its responses
    (position, velocity or acceleration), at least one each; those of the first channel are used where channels
    differ. time: unit of time."""
    position_unit = next(
        (motions[0].removesuffix(suffix) for suffix in _RATE_SUFFIXES if motions[0].endswith(suffix)), motions[0]
    )
    return UnitSystem(commands[0], position_unit, time)


def find_unit_system(recording: Recording) -> UnitSystem | None:
    """Find the units of a model that was fitted to the recording: those of its channels; None where they are SI."""
    time = "s" if recording.is_timed else "sample"
    system = determine_unit_system(recording.command.units, recording.response.units, time)
    return system if system.rotational is None else None


def _decompose_base_unit(name: str) -> tuple[tuple[str, int], ...]:
    """Decompose a unit (N, m, s or kg) into powers of N, m and s, as pairs of name and power; kg = N s^2/m."""
    return (("N", 1), ("s", 2), ("m", -1)) if name == "kg" else ((name, 1),)


def _format_power(name: str, power: int) -> str:
    """Format a unit to a power, such as "s^2"; a name of several units gets parentheses."""
    if power == 1:
        return name
    return f"{f'({name})' if ' ' in name else name}^{power}"
