"""Which hypotheses the data suggest: every effect of the catalogue wherever it could be, with values to start from."""

from collections.abc import Sequence

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, claimed
from equalizer.effects.effect import ALL_SITES, Effect, Values
from equalizer.effects.evidence import Evidence
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME

STARTS = 4
"""At most so many values of each claim are tried."""


def candidates(catalogue: Sequence[Effect], evidence: Evidence) -> tuple[Hypothesis, ...]:
    """In the catalogue's order. Where an effect's own estimator sees nothing, it is not among them."""
    found: list[Hypothesis] = []
    for effect in catalogue:
        sensed = EFFECTS_BY_NAME[effect.name].place == "sensor"
        sites = range(evidence.model.outputs if sensed else evidence.model.inputs)
        starts = [effect.starts(evidence, site)[:STARTS] for site in sites]
        if "one" in effect.sites or len(sites) == 1:
            found += [claimed(Claim(effect, "one", (site,)), [values]) for site in sites for values in starts[site]]
        if len(sites) > 1:
            found += _each(effect, tuple(sites), starts)
            found += _all(effect, tuple(sites), evidence)
    return tuple(found)


def _all(effect: Effect, sites: tuple[int, ...], evidence: Evidence) -> list[Hypothesis]:
    starts = effect.starts(evidence, ALL_SITES)[:STARTS] if "all" in effect.sites else ()
    return [claimed(Claim(effect, "all", sites), [values]) for values in starts]


def _each(effect: Effect, sites: tuple[int, ...], starts: Sequence[tuple[Values, ...]]) -> list[Hypothesis]:
    first = [values[0] for values in starts if values]
    if "each" not in effect.sites or not first:
        return []
    whole = [values[0] if values else _faint(effect, first[0]) for values in starts]
    return [claimed(Claim(effect, "each", sites), whole)]


def _faint(effect: Effect, values: Values) -> Values:
    """Where the data show nothing of it: a tenth of what another axis shows."""
    main = effect.parameters[0]
    return {**values, main.name: values[main.name] / 10 if main.none == 0 else values[main.name]}
