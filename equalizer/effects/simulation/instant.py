"""Layout of the array `at` from which a compiled force law reads the motion in each step; SI units.

Names with FREE denote the motion without the law's own force. A force is held over one step; steep laws (friction,
stops) therefore solve for the force that is consistent with the motion at the step's end, which is stable at any step
length (implicit time stepping with impulses, as for dry friction: Moreau 1988, Stewart 2000). On a rotational axis,
m and N stand for rad and N m.
"""

X, V = 0, 1
"""Position (m) and velocity (m/s) of the axis at the start of the step."""
X_FREE, V_FREE = 2, 3
"""Position and velocity at the step's end without this force."""
X_PER_N, V_PER_N = 4, 5
"""What 1 N over the step adds to position and velocity at its end."""
A_FREE, A_PER_N = 6, 7
"""Acceleration at the start without this force, and what 1 N adds to it; NaN unless the effect declares that its law
reads accelerations."""
STEP_S, TIME_S = 8, 9
"""Length of the step, and time of its start since the first sample, in s."""
F_END = 10
"""Written by the law: its force at the step's end, which determines the acceleration there. Where it stays NaN, the
mean over the step is used."""
LENGTH = 11
"""Length of `at` without the block below."""
SEEN_X, SEEN_V, SEEN_X_END, SEEN_V_END, SEEN_X_PER_N, SEEN_V_PER_N, SEEN_A, SEEN_A_PER_N, SEEN_COMMAND = range(9)
"""Block of each driven axis, for effects that declare that their law reads all axes (`AxisForce.sees`): position and
velocity at the start and, without this force, at the end of the step; what 1 N of this force adds to those at the end;
acceleration at the start without this force, and what 1 N adds to it; command. Blocks follow each other from index
LENGTH on."""
SEEN = 9
"""Numbers per block."""
