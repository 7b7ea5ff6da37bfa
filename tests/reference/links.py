"""Plain twins of the link sensors' kernels: every reading and voxel on its own, by SciPy's densities."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm, t

from elusive.sensors.radio_network import directed_links_of


def excess_lengths(nodes, places):
    """``(N, D)`` excess path of each place over each directed link [m]."""
    tx, rx = nodes.positions_m[directed_links_of(len(nodes.names))].transpose(1, 0, 2)
    around = np.linalg.norm(places[:, None] - tx, axis=2) + np.linalg.norm(places[:, None] - rx, axis=2)
    return around - np.linalg.norm(tx - rx, axis=1)


def shadowing(model, fade_db, nodes, places):
    """Change of the mean and of the squared scale ``(N, D, C)`` by a person at each place."""
    D = excess_lengths(nodes, places)[:, :, None]
    g, f = 1 / (1 + np.exp(-fade_db / 5)), np.exp(-model.fade_slope * fade_db / 10)
    near, far = np.exp(-D / model.near_length_m), np.exp(-D / model.far_length_m)
    mean = -model.loss_db * g * np.exp(-D / model.loss_length_m)
    return mean, f**2 * (model.near_sd_db**2 * near + model.far_sd_db**2 * far)


def shadowed_log_ratio(sensor, places, change, others_mean, variance):
    """Tempered log likelihood ratio of one more person at each place."""
    model = sensor.model
    mean, squared = shadowing(model, sensor.fade_db, sensor.nodes, places)
    there = t.logpdf(change, model.degrees, others_mean + mean, np.sqrt(variance + squared))
    away = t.logpdf(change, model.degrees, others_mean, np.sqrt(variance))
    return sensor.temper_of(change) * np.nansum(there - away, axis=(1, 2))


def bell(model, centres, places):
    """Attenuation ``(N, V)`` of each voxel by a person at each place."""
    angle = np.deg2rad(model.rotation_deg)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    along = (centres - places[:, None]) @ turn.T / (model.width_x_m, model.width_y_m)
    return model.amplitude_db * np.exp(-0.5 * (along**2).sum(axis=2))


def linear_log_ratio(model, weights, centres, places, change, others_mean, variance):
    """Log likelihood ratio of one more person at each place."""
    response = bell(model, centres, places) @ weights.T
    there = norm.logpdf(change, others_mean + response, np.sqrt(variance + (model.spread * response) ** 2))
    away = norm.logpdf(change, others_mean, np.sqrt(variance))
    return np.nansum(there - away, axis=1)
