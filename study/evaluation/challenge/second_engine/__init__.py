"""Concealed cases from a second physics engine, MuJoCo: other integrator, other friction, other contacts."""
