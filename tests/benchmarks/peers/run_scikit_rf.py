"""scikit-rf's vector fitting on the lines of our estimate. Each input has all poles: three times as many states."""

import skrf
from exchange import Data, Model, run
from skrf.vectorFitting import VectorFitting


def identified(data: Data, options: dict) -> Model:
    network = skrf.Network(frequency=skrf.Frequency.from_f(data.frequency_hz, unit="hz"), s=data.estimate)
    fit = VectorFitting(network)
    # There is no line at 0 Hz to preserve.
    fit.vector_fit(n_poles_real=options["real"], n_poles_cmplx=options["pairs"], enforce_dc=False)
    A, B, C, D, _ = fit._get_ABCDE()
    return Model(A, B, C, D, 0.0, uses_estimate=True)


if __name__ == "__main__":
    run(identified, ("scikit-rf", "numpy", "scipy"))
