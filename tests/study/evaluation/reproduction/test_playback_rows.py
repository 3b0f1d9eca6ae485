"""The rows that a reproduction plays have the names under which its findings look them up."""

from types import SimpleNamespace

from analysis.evaluation.reproduction.equalized_findings import EqualizedRows
from study.evaluation.reproduction.reproduce_equalized import _list_rows


def test_every_row_of_the_findings_is_played():
    models = SimpleNamespace(centre=None, frictionless=None)
    rows = _list_rows(models, SimpleNamespace())
    assert set(EqualizedRows.__dataclass_fields__) <= set(rows)
    assert rows["multisine"].signal == rows["frictionless"].signal == "multisine"
    assert rows["unequalized"].driver is rows["edge_unequalized"].driver
