"""The primary analysis: one hierarchical psychometric model of all answers of a study.

`answers` (counted by cell) and `curve` -> `likelihood` -> `marginal` -> `fit` -> `inference`. Begin at `fit.py`.
"""
