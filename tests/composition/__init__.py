"""The grid of every motion, sensor, knowledge and filter, and what of it composes."""
