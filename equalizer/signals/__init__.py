"""Samples that know their rate, unit and channels; recordings; excitations; units; lock-in."""
