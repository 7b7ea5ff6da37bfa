"""Signals: noise objects, told from the noise by their statistics alone."""
