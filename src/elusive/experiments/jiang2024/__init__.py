"""Jiang, Keerativoranan, Matsumoto and Takada (2024), Factor graph-based technique for trajectory tracking."""
