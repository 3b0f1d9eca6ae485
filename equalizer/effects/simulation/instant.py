"""Layout of the array `at` that a compiled force law reads at each instant. "Free" means without the law's own force.

A force is held over one step; laws that are steep (friction, stops) therefore ask what it would do by the step's end
and solve for it, which stays stable at any step (the impulse view of dry friction; Moreau 1988, Stewart 2000).
"""

X, V = 0, 1
"""Position and velocity of the axis at the start of the step."""
X_FREE, V_FREE = 2, 3
"""At its end without this force."""
X_PER_N, V_PER_N = 4, 5
"""What 1 N over the step adds to them."""
A_FREE, A_PER_N = 6, 7
"""Acceleration at the start without this force, and what 1 N adds to it; not a number unless the effect says that its
law asks for it."""
STEP_S, TIME_S = 8, 9
F_END = 10
"""Written by the law: its force at the step's end, which an acceleration shows. Where it leaves NaN, the mean over the
step is taken."""
LENGTH = 11
SEEN_X, SEEN_V, SEEN_X_END, SEEN_V_END, SEEN_X_PER_N, SEEN_V_PER_N, SEEN_A, SEEN_A_PER_N, SEEN_COMMAND = range(9)
"""Of every driven axis, for effects that say that their law sees them: position and velocity at the start and, without
this force, at the end of the step, what 1 N of this force adds to these; the acceleration likewise; and the command.
Axis by axis from LENGTH on, SEEN numbers each."""
SEEN = 9
