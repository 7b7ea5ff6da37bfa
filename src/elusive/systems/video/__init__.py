"""Radar video, before any threshold, under a chart: tracks of ships."""
