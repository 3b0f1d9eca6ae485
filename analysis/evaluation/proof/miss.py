"""Which answers are not as they should be: the strictest reading, for all of them are listed."""

from analysis.evaluation.proof.outcome import Outcome

NOT_EXPLAINED = ("unexplained", "partly_explained")


def is_miss(one: Outcome) -> bool:
    """A wrong name is one even where nothing could be seen; where the true effect is not to be named, any name is."""
    if one.said is None or has_wrong_name(one):
        return True
    if one.kind in ("nothing", "without") or not one.detectable:
        return False
    if one.kind == "outside":
        return one.verdict not in NOT_EXPLAINED
    return not one.right or on_another_axis(one)


def has_wrong_name(one: Outcome) -> bool:
    """An effect is named that is not there, or that was not to be considered."""
    there = () if one.kind in ("nothing", "without") else one.names
    return not set(one.named_names) <= set(there)


def on_another_axis(one: Outcome) -> bool:
    """A right name, but at an axis where nothing is concealed; of devices with several."""
    if len(one.axes) < 2:
        return False
    true = {each.effect: each.axis for each in one.concealed}
    return any(
        true.get(said.effect) is not None and said.axis is not None and said.axis != true[said.effect]
        for said in one.named
    )
