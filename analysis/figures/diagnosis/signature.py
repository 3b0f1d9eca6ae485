"""Figures of the signatures of named effects: the data that identify an effect, with its fitted law.

A signature is the residual of the model without the effect (or the missing force) against the variable that the effect
depends on, such as friction against velocity: means per bin with two standard errors.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from analysis.diagnosis.effect_words import noun_of
from analysis.diagnosis.result.findings import Signature
from analysis.diagnosis.unit_wording import scale_of
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, BLUE, GREY, draw_no_data_note, new_figure, plain_axes
from analysis.wording import capitalise, typeset
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW
from equalizer.signals.signal import FloatArray

_ROUNDED = " Noise limits the bandwidth of the missing force, so corners look rounder than they are."
"""Sentence of the caption where the ordinate is an estimated missing force, whose bandwidth the noise limits."""

_BEYOND = " Shaded: outside the recorded range, where the formula is not tested."
"""Sentence of the caption where the law is drawn beyond the recorded range, as an extrapolation."""


def signature_pictures(signatures: Sequence[Signature]) -> tuple[Picture, ...]:
    """One picture per signature, with caption and alternative text; names are numbered from 1."""
    return tuple(
        Picture(
            name=f"signature-{number}",
            title=f"Signature of {noun_of(signature.effect)}{f' ({signature.axis})' if signature.axis else ''}",
            caption="Dots: residual of the model with all other effects found but without this one, mean per bin; "
            "bars: two standard errors. "
            + (
                "Line: the formula."
                if signature.effect == DISCOVERED_LAW
                else "Line: the fitted law, simulated and averaged alike."
            )
            + (_ROUNDED if signature.of.startswith("missing") else "")
            + (_BEYOND if signature.visited else ""),
            figure=draw_signature(signature),
            alternative=_alternative_text(signature),
        )
        for number, signature in enumerate(signatures, start=1)
    )


def draw_signature(signature: Signature) -> Figure:
    """Figure of one signature: dots with two standard errors, and the fitted law as a line. Spectra have logarithmic
    axes; the range that was not recorded is shaded. A note where there is no bin."""
    figure = new_figure(8.8, 4.0)
    if not len(signature.measured_at):
        return draw_no_data_note(figure, "Too few samples show this effect to draw it.")
    axes = figure.add_subplot()
    plain_axes(axes)
    along, x_factor = _scale_label(signature.along, signature.measured_at)
    of, y_factor = _scale_label(signature.of, np.concatenate([signature.measured, signature.law]))
    spectrum = signature.along.startswith("frequency")
    axes.errorbar(
        x_factor * signature.measured_at, y_factor * signature.measured, yerr=2 * y_factor * signature.spread,
        fmt="o", color=BLACK, markersize=3.8, elinewidth=1.0, capsize=1.8, alpha=0.85, label="missing without it",
        zorder=3,
    )  # fmt: skip
    axes.plot(
        x_factor * signature.law_at, y_factor * signature.law, color=BLUE, linewidth=2.0, label="fitted law", zorder=2
    )
    if spectrum:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(bottom=0.5 * y_factor * float(signature.measured.min()))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    else:
        axes.axhline(0, color=GREY, linewidth=0.8, zorder=1)
        if signature.visited is not None:
            axes.set_ylim(_find_visited_limits(signature, y_factor))
        for begins, ends in _never_visited(signature):
            axes.axvspan(x_factor * begins, x_factor * ends, color=GREY, alpha=0.15, linewidth=0, zorder=0)
        if signature.measured_at.min() < 0 < signature.measured_at.max():
            axes.axvline(0, color=GREY, linewidth=0.8, zorder=1)
    axes.set_xlabel(along)
    axes.set_ylabel(of)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=2, fontsize=9, frameon=False)
    return figure


def _scale_label(text: str, values: FloatArray) -> tuple[str, float]:
    """ "velocity of x (m/s)" as "Velocity of x (mm/s)", with the factor that goes with it."""
    words, bracket, rest = text.rpartition(" (")
    if not bracket or "/√" in rest or rest.startswith("Hz"):
        return capitalise(text), 1.0
    scale = scale_of(rest.removesuffix(")"), float(np.max(np.abs(values))))
    return f"{capitalise(words)} ({scale.unit})", scale.factor


def _find_visited_limits(signature: Signature, factor: float) -> tuple[float, float]:
    """Limits of the ordinate from dots and law within the recorded range, with a margin of 0.75 of their span on either
    side: beyond the range, a formula may have a pole. The signature must have such a range."""
    assert signature.visited is not None
    low, high = signature.visited
    law = signature.law[(signature.law_at >= low) & (signature.law_at <= high)]
    values = factor * np.concatenate([signature.measured, law])
    margin = 0.75 * max(float(np.ptp(values)), 1e-300)
    return float(values.min()) - margin, float(values.max()) + margin


def _never_visited(signature: Signature) -> tuple[tuple[float, float], ...]:
    """Intervals of the abscissa in which the law is drawn but nothing was recorded; empty where these are not known."""
    if signature.visited is None:
        return ()
    low, high = signature.visited
    return ((float(signature.law_at.min()), low), (high, float(signature.law_at.max())))


def _alternative_text(signature: Signature) -> str:
    """Description for screen readers: range of the dots, and rms distance of the law from them."""
    if not len(signature.measured_at) or not len(signature.law_at):
        return ""
    order = np.argsort(signature.law_at)
    law = np.interp(signature.measured_at, signature.law_at[order], signature.law[order])
    size = float(np.sqrt(np.mean(signature.measured**2)))
    apart = float(np.sqrt(np.mean((signature.measured - law) ** 2)))
    share = f"{100 * apart / size:.2g} %" if size else "nothing"
    first, last = (
        f"{typeset(f'{signature.measured[end]:.3g}')} at {typeset(f'{signature.measured_at[end]:.3g}')}"
        for end in (0, -1)
    )
    return (
        f"{capitalise(signature.of)} against {signature.along}: from {first} to {last}. The fitted "
        f"law differs from the dots by {share} of their size, rms."
    )
