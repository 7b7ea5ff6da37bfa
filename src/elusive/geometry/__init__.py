"""Places: areas, local frames."""
