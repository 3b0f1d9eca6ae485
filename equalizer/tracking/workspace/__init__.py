"""One device at many places: models identified at several points, and forces for a place between them."""
