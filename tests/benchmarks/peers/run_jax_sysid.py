"""jax-sysid: Adam, then L-BFGS on the simulated output, from its own start; signals scaled as its examples do."""

import numpy as np
from exchange import Data, Model, decimated, run
from jax_sysid.models import LinearModel


def identified(data: Data, options: dict) -> Model:
    command, response, rate_hz = decimated(data, options["factor"])
    into, out = command.std(axis=0), response.std(axis=0)
    model = LinearModel(data.order, response.shape[1], command.shape[1], feedthrough=True, seed=0)
    model.loss(rho_x0=0.0, rho_th=0.0)
    model.optimization(adam_epochs=options["adam"], lbfgs_epochs=options["lbfgs"], iprint=-1)
    model.fit(response / out, command / into)
    A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in model.ssdata())
    return Model(A, B / into, out[:, None] * C, out[:, None] * D / into, rate_hz)


if __name__ == "__main__":
    run(identified, ("jax-sysid", "jax", "numpy", "scipy"))
