"""Filters that accumulate evidence along trajectories, and the laws of what noise accumulates to."""
