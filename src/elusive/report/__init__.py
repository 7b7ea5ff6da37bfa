"""The page and the figure of a report: the same scripts for every system."""
