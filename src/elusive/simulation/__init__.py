"""Truth to test on: random paths of people through an area, and networks to see them with."""

from elusive.simulation.networks import BorderNodes, GridNodes, ListedNodes, Network
from elusive.simulation.walks import Walks

__all__ = ["BorderNodes", "GridNodes", "ListedNodes", "Network", "Walks"]
