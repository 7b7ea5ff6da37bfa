"""Amrouche, Khenchaf and Berkani (2018), Tracking and Detecting moving weak Targets: scenario, figures, table."""
