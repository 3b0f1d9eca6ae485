"""Paragraphs of a diagnosis report on the method: error measure, split of the samples, noise estimate, re-tuning and
choice of effects, tests in the map of the mismatch."""

from analysis.diagnosis.limits import FALSE_DISCOVERY_RATE, MODEL_FLOOR, RETUNING_BOUND
from analysis.diagnosis.result.findings import Findings
from analysis.wording import conjoin

# Parts of the sentences; free simulation is the output error, predicted force the equation error (inverse dynamics).
_FREE_SIMULATION = (
    "The model was simulated from rest with the recorded commands only, and its response was compared with the "
    "measured one, sample by sample (free simulation)."
)
_PREDICTED_FORCE = (
    "In a free simulation a model of this device drifts away. Instead, the force that it needs for the measured "
    "motion was compared with the commanded force (predicted force)."
)
_NOISE_SOURCES = {
    "repeats": "from what differs between repeats of the same excitation",
    "rest": "from the signals while nothing is driven",
    "quiet band": "from the frequencies above the driven band",
}
"""How the noise was measured, by `NoiseFloor.method`; other methods mean that it could not be measured."""
_SPLIT_USES = (
    ("fit", "were used for the fit"),
    ("choose", "were used to choose between explanations"),
    ("test", "were held out and used only for the final test"),
)
"""Use of each set of samples, by its key in `Findings.split_s`."""


def write_method_paragraphs(findings: Findings) -> tuple[str, ...]:
    """Write the paragraphs in this order: error measure, split of the samples, noise, re-tuning and choice of effects,
    map of the mismatch. The second, third and fourth are left out where they do not apply."""
    return (
        _describe_error_measure(findings),
        *_describe_sample_split(findings),
        *_describe_noise_source(findings),
        *_describe_effect_choice(findings),
        _describe_mismatch_map(),
    )


def _describe_error_measure(findings: Findings) -> str:
    """Describe the error measure that was used, and the units of errors."""
    measure = findings.diagnosis.error
    if measure == "free simulation":
        measure_text = _FREE_SIMULATION
    elif measure == "predicted force":
        measure_text = _PREDICTED_FORCE
    else:
        measure_text = (
            f"In a free simulation a model of this device drifts away. Instead, it was simulated over {measure}, each "
            "started from the measured state, and compared sample by sample."
        )
    return (
        f"{measure_text} Errors in per cent are root-mean-square over the channels, each divided by its own rms; "
        "errors in units of the noise are root-mean-square of one channel, divided by the rms of its noise."
    )


def _describe_sample_split(findings: Findings) -> tuple[str, ...]:
    """Describe the seconds of the recordings that served for fitting, validation and test; none where no times are
    known."""
    split_texts = [
        f"{findings.split_s[role]:.3g} s {use_text}" for role, use_text in _SPLIT_USES if findings.split_s.get(role)
    ]
    return (f"Of the recorded time, {conjoin(split_texts)}.",) if split_texts else ()


def _describe_noise_source(findings: Findings) -> tuple[str, ...]:
    """Describe the source of the noise estimate, with its remarks; none without an estimate."""
    if findings.floor is None:
        return ()
    source_text = _NOISE_SOURCES.get(findings.floor.method)
    noise_text = (
        f"The noise was measured {source_text}."
        if source_text
        else "The noise of this recording could not be measured."
    )
    return (" ".join([noise_text, *findings.floor.remarks]),)


def _describe_effect_choice(findings: Findings) -> tuple[str, ...]:
    """Describe the re-tuning within the calibration's tolerance, and the search for effects; none without a
    mismatch."""
    if not findings.diagnosis.mismatch:
        return ()
    bound_sd = RETUNING_BOUND if findings.tuning is None else findings.tuning.bound
    return (
        "First the model's own parameters were re-tuned, each held by the stated standard deviation of its "
        f"calibration and moved by at most {bound_sd:g} of them. Then every effect of the catalogue was tried at every "
        "possible place, with starting values from the residual; the most likely were fitted together with the "
        "model's parameters, and the best was kept if it lowered the error sufficiently on data to which it was not "
        f"fitted. This was repeated for further effects, at most three in all. A share of {100 * MODEL_FLOOR:g} % of "
        "each channel's signal counts as noise, because no model is better than that.",
    )


def _describe_mismatch_map() -> str:
    """Describe the significance tests in the map of the mismatch: false discovery rate, closed testing."""
    return (
        "In the map, an error that clean recordings (without missing physics) also have counts as no mismatch; the "
        "error of the most complete model on held-out data of the same channel, in the same octave and the "
        "neighbouring ones, counts as its usual error. A residual is significant where it exceeds these and the "
        f"noise, with the false discovery rate held at {100 * FALSE_DISCOVERY_RATE:g} % by closed testing: channel, "
        "then band, then level."
    )
