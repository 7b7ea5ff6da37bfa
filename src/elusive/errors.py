"""Errors whose message is a sentence: what was wrong, where, and what to do."""

from __future__ import annotations


class ElusiveError(ValueError):
    """Base of every error that bad input raises."""


class ParameterError(ElusiveError):
    """A parameter of a model is missing, misspelt or out of its bounds."""


class DataError(ElusiveError):
    """A measurement, frame or recording cannot be used."""


class StoreError(ElusiveError):
    """A campaign's store belongs to another configuration or cannot be written."""
