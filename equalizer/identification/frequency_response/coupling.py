"""Cross-axis coupling of a frequency response."""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


def worst_coupling(response: ComplexArray) -> FloatArray:
    """Off-axis over on-axis response when one axis i is driven, for the worst axis:

        max over i of sqrt(sum over j != i of |H_ji|²) / |H_ii|

    response: H (..., outputs, inputs), both in the same frame. Returns (...). Raises ValueError if not square.
    """
    require_equal_axes(response)
    power = np.abs(response) ** 2
    on_axis = np.einsum("...ii->...i", power)
    off_axis = np.maximum(power.sum(axis=-2) - on_axis, 0.0)
    ratio: FloatArray = np.sqrt(off_axis / np.maximum(on_axis, np.finfo(np.float64).tiny)).max(axis=-1)
    return ratio


def require_equal_axes(response: ComplexArray) -> None:
    """Require as many outputs as inputs. Raises ValueError unless the response (..., outputs, inputs) is square."""
    outputs, inputs = response.shape[-2:]
    if outputs != inputs:
        raise ValueError(f"coupling compares equal axes, but there are {outputs} outputs and {inputs} inputs")
