"""SLICOT's subspace driver in a C translation. Its B and D are far off, so that ours are put to its A and C."""

import ctrlsys
import numpy as np
from exchange import Data, Model, decimated, input_matrices, run


def identified(data: Data, options: dict) -> Model:
    command, response, rate_hz = decimated(data, options["factor"])
    rows, p, m = options["rows"], response.shape[1], command.shape[1]
    u, y = np.asfortranarray(command), np.asfortranarray(response)
    # Cholesky: here the same singular values as by orthogonal factors, in a thirtieth of the time.
    n, factor, _, warning, info = ctrlsys.ib01ad("M", "C", "N", "O", "N", "N", rows, m, p, u, y, 0.0, -1.0)
    if info:
        raise RuntimeError(f"ib01ad: info {info}, warning {warning}, order {n}")
    job = "A" if options["own"] else "C"
    A, C, B, D, *_, info = ctrlsys.ib01bd("M", job, "N", rows, data.order, m, p, len(u), factor, 0.0)
    if info:
        raise RuntimeError(f"ib01bd: info {info}")
    if options["own"]:
        return Model(A, B, C, D, rate_hz)
    B, D = input_matrices(data, A, C, rate_hz)
    return Model(A, B, C, D, rate_hz, uses_estimate=True)


if __name__ == "__main__":
    run(identified, ("ctrlsys", "numpy"))
