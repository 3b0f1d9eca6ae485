"""pyMOR's Loewner interpolation through some lines of our estimate."""

from exchange import Data, Model, run
from numpy import pi
from pymor.core.logger import set_log_levels
from pymor.reductors.loewner import LoewnerReductor


def identified(data: Data, options: dict) -> Model:
    set_log_levels({"pymor": "ERROR"})
    low, high = data.band_hz
    inside = (data.frequency_hz >= low) & (data.frequency_hz <= high)
    some = slice(None, None, max(1, inside.sum() // options["lines"]))
    points = 2j * pi * data.frequency_hz[inside][some]
    model = LoewnerReductor(points, data.estimate[inside][some]).reduce(r=data.order)
    A, B, C, D, E = model.to_matrices()
    return Model(A, B, C, 0.0 * (C @ B) if D is None else D, 0.0, E, uses_estimate=True)


if __name__ == "__main__":
    run(identified, ("pymor", "numpy", "scipy"))
