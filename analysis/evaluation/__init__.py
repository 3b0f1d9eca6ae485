"""Evaluation of the product: findings judged by stated rules.

`blind_test` scores answers of the diagnosis; `reproduction` puts the published figures beside what came out
here. Begin at `blind_test/score.py`.
"""
