"""What tracks claim of plots, plot by plot: the formulas of Musicki and La Scala (2008) as they are written."""

import numpy as np

from tests.reference.radar import log_ratio


def density(sensor, particles, weights, scan, plot):
    """Density of one plot if it is a track's, to that of false alarms."""
    alone = scan._replace(**{name: getattr(scan, name)[[plot]] for name in scan._fields[1:5]}, claimed=None)
    certain = sensor.replace(detection_probability=1.0)
    return float(weights @ np.exp(log_ratio(certain, particles, alone)))


def claims(ratio, existence, detection_probability):
    """Claim of each track of each plot."""
    found = np.zeros(ratio.shape)
    for track in range(ratio.shape[0]):
        total = sum(ratio[track])
        for plot in range(ratio.shape[1]):
            if ratio[track, plot] == 0:
                continue
            share = min(detection_probability * existence[track], 1 - 1e-6) * ratio[track, plot] / total
            found[track, plot] = ratio[track, plot] * share / (1 - share)
    return found
