"""Figures of the signatures of named effects: the data that identify an effect, with its fitted law.

A signature is the residual of the model without the effect (or the missing force) against the variable that the effect
depends on, such as friction against velocity: means per bin (of some effects running rms or amplitude densities) with
two standard errors.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.result.findings import Signature
from analysis.diagnosis.unit_wording import choose_scale
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, BLUE, GREY, create_figure, draw_no_data_note, style_axes
from analysis.wording import capitalise, typeset
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.signals.signal import FloatArray

_BANDWIDTH_NOTE = " Noise limits the bandwidth of the missing force, so corners look rounder than they are."
"""Sentence of the caption where the ordinate is an estimated missing force."""

_EXTRAPOLATION_NOTE = " Shaded: outside the recorded range, where the formula is not tested."
"""Sentence of the caption where the recorded range is known."""


def make_signature_pictures(signatures: Sequence[Signature]) -> tuple[Picture, ...]:
    """Make a picture per signature, with caption and alternative text; names are numbered from 1."""
    return tuple(
        Picture(
            name=f"signature-{number}",
            title=f"Signature of {get_noun(signature.effect)}{f' ({signature.axis})' if signature.axis else ''}",
            caption="Dots: residual of the model with all other effects found but without this one, mean per bin; "
            "bars: two standard errors. "
            + (
                "Line: the fitted law, simulated and averaged alike."
                if signature.effect in EFFECTS_BY_NAME
                else "Line: the formula."  # of a discovered law, or one from an effect file
            )
            + (_BANDWIDTH_NOTE if signature.ordinate_label.startswith("missing") else "")
            + (_EXTRAPOLATION_NOTE if signature.visited_range else ""),
            figure=draw_signature(signature),
            alternative=_describe_signature(signature),
        )
        for number, signature in enumerate(signatures, start=1)
    )


def draw_signature(signature: Signature) -> Figure:
    """Draw one signature: dots with bars of two standard errors, and the fitted law as a line. Spectra have logarithmic
    axes; elsewhere the range that was not recorded is shaded. Without a bin, the figure holds a note instead."""
    figure = create_figure(8.8, 4.0)
    if not len(signature.measured_abscissa):
        return draw_no_data_note(figure, "Too few samples show this effect to draw it.")
    axes = figure.add_subplot()
    style_axes(axes)
    x_label, x_factor = _rescale_label(signature.abscissa_label, signature.measured_abscissa)
    y_label, y_factor = _rescale_label(signature.ordinate_label, np.concatenate([signature.measured, signature.law]))
    is_spectrum = signature.abscissa_label.startswith("frequency")
    axes.errorbar(
        x_factor * signature.measured_abscissa, y_factor * signature.measured,
        yerr=2 * y_factor * signature.standard_error, fmt="o", color=BLACK, markersize=3.8, elinewidth=1.0,
        capsize=1.8, alpha=0.85, label="missing without it", zorder=3,
    )  # fmt: skip
    axes.plot(
        x_factor * signature.law_abscissa,
        y_factor * signature.law,
        color=BLUE,
        linewidth=2.0,
        label="fitted law",
        zorder=2,
    )
    if is_spectrum:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(bottom=0.5 * y_factor * float(signature.measured.min()))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("")
    else:
        axes.axhline(0, color=GREY, linewidth=0.8, zorder=1)
        if signature.visited_range is not None:
            axes.set_ylim(_compute_visited_limits(signature, y_factor))
        for range_start, range_end in _list_unvisited_ranges(signature):
            axes.axvspan(x_factor * range_start, x_factor * range_end, color=GREY, alpha=0.15, linewidth=0, zorder=0)
        if signature.measured_abscissa.min() < 0 < signature.measured_abscissa.max():
            axes.axvline(0, color=GREY, linewidth=0.8, zorder=1)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=2, fontsize=9, frameon=False)
    return figure


def _rescale_label(text: str, values: FloatArray) -> tuple[str, float]:
    """Choose the unit prefix of an axis label by the largest value: "velocity of x (m/s)" becomes "Velocity of x
    (mm/s)". Returns the label and the factor to multiply the values with; for spectra, and without a unit, the factor
    is 1."""
    words, bracket, unit_text = text.rpartition(" (")
    if not bracket or "/√" in unit_text or unit_text.startswith("Hz"):
        return capitalise(text), 1.0
    scale = choose_scale(unit_text.removesuffix(")"), float(np.max(np.abs(values))))
    return f"{capitalise(words)} ({scale.unit})", scale.factor


def _compute_visited_limits(signature: Signature, unit_factor: float) -> tuple[float, float]:
    """Compute the limits of the ordinate, in the shown unit, from dots and law within the recorded range, with a margin
    of 0.75 (chosen) of their span on either side: beyond the range, a formula may have a pole. unit_factor: from SI to
    the shown unit. signature: with a `visited_range`."""
    assert signature.visited_range is not None
    low, high = signature.visited_range
    law_in_range = signature.law[(signature.law_abscissa >= low) & (signature.law_abscissa <= high)]
    values = unit_factor * np.concatenate([signature.measured, law_in_range])
    margin = 0.75 * max(float(np.ptp(values)), 1e-300)
    return float(values.min()) - margin, float(values.max()) + margin


def _list_unvisited_ranges(signature: Signature) -> tuple[tuple[float, float], ...]:
    """List the intervals of the abscissa in which the law is drawn but nothing was recorded; empty where the recorded
    range is not known."""
    if signature.visited_range is None:
        return ()
    low, high = signature.visited_range
    return ((float(signature.law_abscissa.min()), low), (high, float(signature.law_abscissa.max())))


def _describe_signature(signature: Signature) -> str:
    """Describe for screen readers the first and last dot, and the rms distance of the law from the dots, relative to
    their rms; empty without dots or law."""
    if not len(signature.measured_abscissa) or not len(signature.law_abscissa):
        return ""
    order = np.argsort(signature.law_abscissa)
    law_at_dots = np.interp(signature.measured_abscissa, signature.law_abscissa[order], signature.law[order])
    rms_measured = float(np.sqrt(np.mean(signature.measured**2)))
    rms_distance = float(np.sqrt(np.mean((signature.measured - law_at_dots) ** 2)))
    share_text = f"{100 * rms_distance / rms_measured:.2g} %" if rms_measured else "nothing"
    first, last = (
        f"{typeset(f'{signature.measured[index]:.3g}')} at {typeset(f'{signature.measured_abscissa[index]:.3g}')}"
        for index in (0, -1)
    )
    return (
        f"{capitalise(signature.ordinate_label)} against {signature.abscissa_label}: from {first} to {last}. The "
        f"fitted law differs from the dots by {share_text} of their size, rms."
    )
