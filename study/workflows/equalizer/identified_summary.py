"""Summary of an identified device for `hapteq identify` and its report: lines of text, plain values for JSON."""

from typing import Any

from equalizer.plant.model_quality import convert_quality_to_json, write_quality_sentence
from study.workflows.equalizer.identify_model import IdentifiedDevice


def summarise_model(device: IdentifiedDevice) -> dict[str, Any]:
    """Summarise quality, order, band (Hz) and errors of the identified model as JSON values; errors are relative to the
    response (1 = 100 %), times in s. `lines`: number of spectral lines (frequencies) of the estimate in the band,
    without its margins; `held_out_...`: None without a test recording."""
    model, held_out_test = device.model, device.held_out_test
    lowest_hz, highest_hz = model.band_hz
    return {
        "model": str(device.plan.out),
        "quality": convert_quality_to_json(model.quality),
        "order": model.order,
        "band_hz": [lowest_hz, highest_hz],
        "spectral_radius": model.spectral_radius,
        "lines": device.identified.lines,
        "rms_relative_error": device.identified.rms_relative_error,
        "worst_relative_error": device.identified.worst_relative_error,
        "held_out_error": held_out_test.error if held_out_test else None,
        "held_out_noise": held_out_test.noise if held_out_test else None,
        "held_out_s": held_out_test.seconds if held_out_test else None,
        "freed_of": model.provenance["freed_of"],
        "remarks": list(device.remarks),
    }


def format_summary(device: IdentifiedDevice) -> tuple[str, ...]:
    """Format quality, order, band (Hz) and errors (%) as lines of text, and the effects that were subtracted from the
    recordings if there are any."""
    summary = summarise_model(device)
    lowest_hz, highest_hz = summary["band_hz"]
    lines = [
        write_quality_sentence(device.model.quality),
        f"Order {summary['order']}, {lowest_hz:g} to {highest_hz:g} Hz, stable (slowest pole "
        f"{summary['spectral_radius']:.5f}), from {summary['lines']} lines.",
        f"Model against estimate: {100 * summary['rms_relative_error']:.2f} % rms, worst line "
        f"{100 * summary['worst_relative_error']:.2f} %; both include the noise of the estimate.",
    ]
    if summary["freed_of"]:
        lines.append(
            f"Subtracted from the recordings: {', '.join(summary['freed_of'])}; give --physics when playing, too."
        )
    return tuple(lines)
