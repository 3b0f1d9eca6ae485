"""Layout of the array `step_motion` from which a compiled force law reads the motion in each step; SI units.

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
"""Change of position and velocity at the step's end per 1 N held over the step."""
A_FREE, A_PER_N = 6, 7
"""Acceleration at the start without this force, and its change per 1 N. The former may be NaN unless the effect
declares that its law reads accelerations."""
STEP_S, TIME_S = 8, 9
"""Length of the step, and time of its start since the first sample, in s."""
F_END = 10
"""Written by the law: its force at the step's end, for the acceleration there. Where it stays NaN, a simulation uses
the mean over the step."""
LENGTH = 11
"""Length of `step_motion` without the blocks below."""
AXIS_X, AXIS_V, AXIS_X_END, AXIS_V_END, AXIS_X_PER_N, AXIS_V_PER_N, AXIS_A, AXIS_A_PER_N, AXIS_COMMAND = range(9)
"""Indices within the block of a driven axis, for effects that declare that their law reads all axes
(`AxisForce.reads_all_axes`): position and velocity at the start and, without this force, at the end of the step; change
of those at the end per 1 N of this force; acceleration at the start without this force, and its change per 1 N;
command. Blocks follow each other from index LENGTH on."""
BLOCK_SIZE = 9
"""Number of values per block."""
