"""From recordings to a model: transfer estimate, subspace, refinement, order."""
