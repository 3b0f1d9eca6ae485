import numpy as np
import pytest

from equalizer.identification.mechanical.modal_structure import transform_to_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel


@pytest.mark.parametrize("shapes", [[[1.0, 0.5]], [[1.0, 0.5], [2.0, 1.0]]])
def test_modes_that_do_not_move_each_axis_by_itself_are_refused(shapes):
    """Fewer modes than axes, and modes of parallel shapes."""
    n = len(shapes)
    model = MechanicalModel("modes", "position", np.eye(n), np.eye(n), np.eye(n), np.array(shapes), np.array(shapes).T)
    with pytest.raises(np.linalg.LinAlgError, match="no mode moves one of the driven axes"):
        transform_to_driven_axes(model)
