"""nfoursid: makes an N x N matrix of N samples, so it is given the middle of the record, 30 s of each axis at least."""

import pandas as pd
from exchange import Data, Model, decimated, run
from nfoursid.nfoursid import NFourSID


def identified(data: Data, options: dict) -> Model:
    factor = options["factor"]
    middle = slice((data.starts[0] + data.period) // factor, (data.stops[-1] - data.period) // factor)
    command, response, rate_hz = decimated(data, factor, middle)
    inputs, outputs = ["u0", "u1", "u2"], ["y0", "y1", "y2"]
    table = pd.DataFrame(command, columns=inputs).join(pd.DataFrame(response, columns=outputs))
    method = NFourSID(table, output_columns=outputs, input_columns=inputs, num_block_rows=options["rows"])
    method.subspace_identification()
    model, _ = method.system_identification(rank=data.order)
    return Model(model.a, model.b, model.c, model.d, rate_hz)


if __name__ == "__main__":
    run(identified, ("nfoursid", "numpy", "pandas"))
