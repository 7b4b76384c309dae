"""Submissions: a folder with one method's rows, card and cost, checked before it enters the leaderboard."""
