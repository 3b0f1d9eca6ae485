"""Layout of the array `at` that a compiled force law reads at each instant. "Free" means without the law's own force.

A force is held over one step; steep laws (friction, stops) therefore solve for the force that is consistent with the
motion at the step's end, which is stable at any step length (the impulse view of dry friction; Moreau 1988, Stewart
2000).
"""

X, V = 0, 1
"""Position and velocity of the axis at the start of the step."""
X_FREE, V_FREE = 2, 3
"""The same at the step's end without this force."""
X_PER_N, V_PER_N = 4, 5
"""What 1 N over the step adds to position and velocity at its end."""
A_FREE, A_PER_N = 6, 7
"""Acceleration at the start without this force, and what 1 N adds to it; NaN unless the effect declares that its law
reads accelerations."""
STEP_S, TIME_S = 8, 9
F_END = 10
"""Written by the law: its force at the step's end, which determines the acceleration there. Where it stays NaN, the
mean over the step is used."""
LENGTH = 11
SEEN_X, SEEN_V, SEEN_X_END, SEEN_V_END, SEEN_X_PER_N, SEEN_V_PER_N, SEEN_A, SEEN_A_PER_N, SEEN_COMMAND = range(9)
"""Block of all driven axes, for effects that declare that their law reads it: position and velocity at the start and,
without this force, at the end of the step; what 1 N of this force adds to these; the acceleration likewise; and the
command. One block of SEEN numbers per axis, from index LENGTH on."""
SEEN = 9
