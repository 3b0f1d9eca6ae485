"""SIPPY: its horizon must exceed the order, or the order is cut without a word."""

from exchange import Data, Model, decimated, run
from sippy_unipi import system_identification


def identified(data: Data, options: dict) -> Model:
    command, response, rate_hz = decimated(data, options["factor"])
    model = system_identification(
        response.T,
        command.T,
        options["method"],
        tsample=1 / rate_hz,
        SS_f=options["rows"],
        SS_p=options["rows"],
        SS_fixed_order=data.order,
        SS_D_required=True,
        SS_A_stability=options["stability"],
    )
    return Model(model.A, model.B, model.C, model.D, rate_hz)


if __name__ == "__main__":
    run(identified, ("sippy_unipi", "numpy", "scipy"))
