"""numba decorator of all functions that run within a tick of the simulated device; used by all modules of the tick."""

from numba import njit

inlined = njit(forceinline=True, error_model="numpy")
"""Compiles a function inline into its callers, which was measured as a third faster than calls. Division by zero gives
inf or NaN, which the safety layer detects, and raises no exception in the middle of a tick."""
