"""Gaussian beliefs: Kalman, extended, interacting, fixed lag, maximum a posteriori, factor graph, geolocation."""
