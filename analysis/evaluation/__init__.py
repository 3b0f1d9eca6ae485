"""Evaluation of the product by stated rules: scores of blind tests, and comparison with published figures.

`blind_test` scores diagnoses of concealed effects, `laws` those of concealed laws outside the catalogue; `reproduction`
compares the published figures with those of a simulated device. Used by `study.evaluation` and `analysis.reports`.
Begin at `blind_test/score.py`.
"""
