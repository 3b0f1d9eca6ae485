"""Evaluation of the product: findings judged by stated rules.

`proof` (blind tests) scores answers of the diagnosis; `reproduction` puts the published figures beside what came out
here. Begin at `proof/score.py`.
"""
