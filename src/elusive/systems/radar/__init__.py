"""Radar plots: ships near coasts that charts know only imprecisely."""
