"""Ours: estimate and identification both counted."""

from exchange import Data, Model, run

from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer
from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal


def recording_of(data: Data) -> Recording:
    command = Signal(data.command, data.rate_hz, "force", "N", ("fx", "fy", "fz"))
    response = Signal(data.response, data.rate_hz, "acceleration", "m/s^2", ("ax", "ay", "az"))
    segments = tuple(
        Segment(int(start), int(stop), "sweep", 1.0, data.period)
        for start, stop in zip(data.starts, data.stops, strict=True)
    )
    return Recording("benchmark", command, response, segments=segments)


def identified(data: Data, options: dict) -> Model:
    recording = recording_of(data)
    settings = IdentificationSettings(data.band_hz, data.order)
    model = identify(estimate_transfer([recording]), settings, records=(recording,)).model
    return Model(model.A, model.B, model.C, model.D, model.sample_rate_hz)


if __name__ == "__main__":
    run(identified, ("numpy", "scipy"))
