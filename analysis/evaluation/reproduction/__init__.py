"""Comparison of the published figures with their reproduction: findings, judged by stated rules."""
