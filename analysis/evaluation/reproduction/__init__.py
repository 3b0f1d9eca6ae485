"""The published figures beside what came out here: findings, judged by stated rules."""
