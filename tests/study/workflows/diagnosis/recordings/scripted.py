"""An engine that finds what was found before."""

import pytest

from study.errors import StudyError
from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan, diagnose_recordings


class Scripted:
    """An engine that finds what was found before, and writes down what it was asked."""

    def __init__(self, findings, ends_with=None):
        self.findings, self.ends_with = findings, ends_with

    def __call__(self, recordings, model, settings, map_, progress):
        self.recordings, self.model, self.settings = recordings, model, settings
        self.mapped = list(map_(abs, [-3, -1, -2]))
        progress("half of it", 0.5)
        if self.ends_with is not None:
            raise self.ends_with
        return self.findings


def quiet(what, share):
    pass


class EnoughSeenError(Exception):
    """Ends a diagnosis before it is written, which takes long."""


def asked_of_engine(a_plan, findings) -> Scripted:
    engine = Scripted(findings, EnoughSeenError())
    with pytest.raises(EnoughSeenError):
        diagnose_recordings(a_plan, quiet, engine)
    return engine


def plan(files, out, **more) -> DiagnosePlan:
    return DiagnosePlan(**{"sources": (files / "rec.h5",), "out": out, "model": files / "model.toml", **more})


def refused_with(files, findings, tmp_path, **more) -> StudyError:
    with pytest.raises(StudyError) as refused:
        diagnose_recordings(plan(files, tmp_path / "out", **more), quiet, Scripted(findings))
    assert not (tmp_path / "out").exists()
    return refused.value
