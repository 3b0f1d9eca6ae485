"""The models behind figure 5: identified once from each recording, and used again by the next run."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.evaluation.reproduction.document import UsedModel
from equalizer.identification.state_space.held_out import HeldOut, held_out
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.recording import Recording
from study.evaluation.reproduction.reproduce_recordings import Recorded
from study.evaluation.reproduction.reproduction_plan import ReproductionPlan
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.provenance import sha256_of
from study.store.formats.identified_model_file import read_identified_model
from study.workflows.equalizer.identify_model import IdentifyPlan, identify_model


@dataclass(frozen=True, slots=True, eq=False)
class ReproducedModel:
    model: IdentifiedModel
    """It holds the spring: what is played under the same spring needs no other account of it."""
    tested: HeldOut | None

    def used(self, name: str) -> UsedModel:
        """name: of its recording."""
        quality = self.model.quality
        assert quality is not None, "every model that is kept or made here has one"
        return UsedModel(name.replace("_", " "), quality.expected_error, quality.held_out_error, quality.held_out_noise)


def modelled(plan: ReproductionPlan, recorded: Recorded, on_share: Callable[[float], None]) -> ReproducedModel:
    """A file in the way that is not of this recording, order and band, or without its quality, is made again."""
    path = plan.models / recorded.path.name
    model = _kept(path, plan, recorded.path)
    if model is None:
        path.unlink(missing_ok=True)
        asked = IdentifyPlan((recorded.path,), path, plan.band_hz, plan.order, with_spring=True)
        model = identify_model(asked, on_share).model
    on_share(1.0)
    return ReproducedModel(model, held_out(model, (from_excitation(recorded.recording),)))


def _kept(path: Path, plan: ReproductionPlan, source: Path) -> IdentifiedModel | None:
    try:
        model = read_identified_model(path) if path.exists() else None
    except UnusableFileError:
        return None
    if model is None or model.quality is None or (model.order, model.band_hz) != (plan.order, plan.band_hz):
        return None
    parents = [parent.get("sha256") for parent in model.provenance.get("parents", ())]
    return model if parents == [sha256_of(source)] else None


def from_excitation(recording: Recording) -> Recording:
    """As the model sees it, the spring a part of the device."""
    return replace(recording, command=recording.excitation or recording.command)
