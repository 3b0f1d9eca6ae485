"""Workspace interpolation: models identified at several places, and forces for a place between them."""
