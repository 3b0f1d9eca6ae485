"""What is said of how much could be predicted at all: by all laws together, and by a model without physics."""

from collections.abc import Sequence

from analysis.diagnosis.result.findings import BlackBox, Reached
from analysis.diagnosis.settings import SAME_TO_READERS
from analysis.diagnosis.unit_wording import error_text, share_text
from analysis.wording import capital

SAME = 1e-9
"""Share by which two errors of the same numbers may differ by rounding."""


def black_box_sentence(box: BlackBox | None, named: bool) -> str:
    if box is None:
        return ""
    physics = "the physics" if named else "the re-tuned model"
    fitted = f"A black box ({box.kind}, {box.numbers} numbers), fitted to the same samples, leaves"
    errors = f"{error_text(box.test)} of the signal on the held-out data; {physics} leaves {error_text(box.physics)}"
    if black_box_beats(box):
        return f"{fitted} {errors}. The black box predicts better: the data hold something that was not named."
    if box.physics * SAME_TO_READERS < box.test:
        return f"{fitted} {errors}. {capital(physics)} predicts better."
    return f"{fitted} {errors}: no better."


def black_box_beats(box: BlackBox) -> bool:
    return box.test * SAME_TO_READERS < box.physics


def ceiling_sentences(reached: Sequence[Reached]) -> tuple[str, ...]:
    """One per axis whose force balance was weighed."""
    return tuple(_ceiling(each, len(reached) == 1) for each in reached)


def _ceiling(reached: Reached, single: bool) -> str:
    along = "" if single else f" along {reached.axis}"
    if not reached.tested:
        return (
            f"In the force balance{along}, no law could be tested: the device moves once, and next to nothing moves in "
            "what was held back. Record several moves, or hold one of them back."
        )
    model = "the re-tuned model leaves" if reached.given else "mass, damping and stiffness alone leave"
    alone = f"In the force balance{along}, on held-out data, {model} {error_text(reached.linear)} of the force"
    named = f"what is named leaves {error_text(reached.named)}" if reached.any_named else "no law is named"
    if reached.any_named and reached.named <= reached.ceiling * (1 + SAME):
        return f"{alone}, {named}, and all laws together leave no less."
    share = f"; that is {share_text(reached.share)} of the way" if reached.named < reached.linear else ""
    return (
        f"{alone}, and all laws together {error_text(reached.ceiling)}, which no sum of a few laws should be expected "
        f"to beat: {named}{share}."
    )
