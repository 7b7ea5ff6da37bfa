"""Bearings: emitters that are only heard from somewhere."""
