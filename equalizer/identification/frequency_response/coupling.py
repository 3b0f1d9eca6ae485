"""Cross-axis coupling of a frequency response: how strongly the other axes respond when one axis is driven.

Called by `coupling_onset` (frequency from which coupling disturbs) and `analysis.figures.frequency_bands`.
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


def compute_worst_coupling(response: ComplexArray) -> FloatArray:
    """Compute the ratio of the off-axis to the on-axis response when axis i is driven, for the axis i with the largest
    ratio:

        max over i of sqrt(sum over j != i of |H_ji|²) / |H_ii|

    response: complex H (..., outputs, inputs), both in the same frame. Returns (...). An axis whose
    response is off-axis only gives a very large number. Raises ValueError if H is not square.
    """
    require_square_response(response)
    power = np.abs(response) ** 2
    on_axis = np.einsum("...ii->...i", power)
    off_axis = np.maximum(power.sum(axis=-2) - on_axis, 0.0)
    coupling: FloatArray = np.sqrt(off_axis / np.maximum(on_axis, np.finfo(np.float64).tiny)).max(axis=-1)
    return coupling


def require_square_response(response: ComplexArray) -> None:
    """Require as many outputs as inputs. Raises ValueError unless the response (..., outputs, inputs) is square."""
    output_count, input_count = response.shape[-2:]
    if output_count != input_count:
        raise ValueError(f"coupling compares equal axes, but there are {output_count} outputs and {input_count} inputs")
