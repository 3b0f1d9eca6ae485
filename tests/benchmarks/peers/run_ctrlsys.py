"""SLICOT's subspace drivers in a C translation: IB01AD, IB01BD for A and C, then IB01CD for B and D, or ours.
The B and D that IB01BD returns are more than 100 % off, and its N4SID refuses order 26 ("Parameter 30")."""

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
    A, C, *_, info = ctrlsys.ib01bd("M", "C", "N", rows, data.order, m, p, len(u), factor, 0.0)
    if info:
        raise RuntimeError(f"ib01bd: info {info}")
    if not options["own"]:
        B, D = input_matrices(data, A, C, rate_hz)
        return Model(A, B, C, D, rate_hz, uses_estimate=True)
    A, C = np.asfortranarray(A), np.asfortranarray(C)
    B, D = np.zeros((data.order, m), order="F"), np.zeros((p, m), order="F")
    # Works in place on what it is given.
    _, B, D, *_, info = ctrlsys.ib01cd("X", "C", "D", data.order, m, p, A.copy("F"), B, C.copy("F"), D, u, y, 0.0)
    if info:
        raise RuntimeError(f"ib01cd: info {info}")
    return Model(A, B, C, D, rate_hz)


if __name__ == "__main__":
    run(identified, ("ctrlsys", "numpy"))
