"""Plain twin of the radar sensor's kernel: SciPy's densities and cumulative distributions, summed over the plots."""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

TURN = 2 * np.pi
TURNS = TURN * np.arange(-3, 4)


def measured(sensor, states, later=0.0):
    """Range, bearing from 0 to 2 pi and range rate of each state some time later."""
    x, y = states[:, 0] + later * states[:, 1] - sensor.x_m, states[:, 2] + later * states[:, 3] - sensor.y_m
    place = y + 1j * x
    bearing = np.angle(place)
    rate = ((states[:, 3] + 1j * states[:, 1]) * np.exp(-1j * bearing)).real
    return abs(place), bearing % TURN, rate


def sector(sensor):
    """First bearing and width of the sector in view [rad]."""
    width = (sensor.to_bearing_deg - sensor.from_bearing_deg) % 360 or 360.0
    return np.deg2rad(sensor.from_bearing_deg), np.deg2rad(width)


def in_view(sensor, distance, bearing):
    """Whether places lie in the field of view."""
    first, width = sector(sensor)
    highest = np.inf if sensor.max_range_m is None else sensor.max_range_m
    inside = ((bearing - first) % TURN <= width) | (width == TURN)
    return (distance >= sensor.min_range_m) & (distance <= highest) & inside


def log_density(sensor, states, plot, later=0.0):
    """Log density of one plot of a detected target, cut to the field of view; angles and Doppler the nearest way."""
    range_m, bearing_rad, doppler_mps = plot
    first, width = sector(sensor)
    sd = sensor.bearing_sd_mrad / 1000
    highest = np.inf if sensor.max_range_m is None else sensor.max_range_m
    here, now, _ = measured(sensor, states)
    distance, bearing, rate = measured(sensor, states, later)
    log_range = norm.logpdf(range_m, distance, sensor.range_sd_m)
    log_range -= np.log(
        norm.cdf(highest, here, sensor.range_sd_m) - norm.cdf(sensor.min_range_m, here, sensor.range_sd_m)
    )
    log_bearing = np.max([norm.logpdf(bearing_rad + turn, bearing, sd) for turn in TURNS], axis=0)
    last = first + width
    log_bearing -= np.log(sum(norm.cdf(last + turn, now, sd) - norm.cdf(first + turn, now, sd) for turn in TURNS))
    if np.isnan(doppler_mps):
        return log_range + log_bearing
    folds = [0.0] if sensor.max_doppler_mps is None else 2 * sensor.max_doppler_mps * np.arange(-4, 5)
    log_doppler = np.max([norm.logpdf(doppler_mps + fold, rate, sensor.doppler_sd_mps) for fold in folds], axis=0)
    return log_range + log_bearing + log_doppler


def relative_density(sensor, distance, bearing):
    """Density of false alarms at a place, to that of uniform ones: bands, each twice as wide as the one nearer."""
    first_rad, width_rad = sector(sensor)
    shares = sensor.false_alarm_sectors
    fraction = ((bearing - first_rad) % (2 * np.pi)) / width_rad
    turned = shares[min(int(fraction * len(shares)), len(shares) - 1)] / sum(shares) * len(shares)
    low, high, shares = sensor.min_range_m, sensor.max_range_m, sensor.false_alarm_shares
    first = (high - low) / (2 ** len(shares) - 1)
    end = low
    for k, share in enumerate(shares):
        width, end = first * 2**k, end + first * 2**k
        if distance < end or k == len(shares) - 1:
            return turned * share / sum(shares) / (width / (high - low))
    raise AssertionError


def patched(sensor, distance, bearing):
    """Density of the false alarms of patches at a place, a metre and radian."""
    total = 0.0
    for near, far, first, last, number in sensor.false_alarm_patches:
        width = np.deg2rad(last - first) % (2 * np.pi) or 2 * np.pi
        if near <= distance < far and (bearing - np.deg2rad(first)) % (2 * np.pi) < width:
            total += number / ((far - near) * width)
    return total


def log_ratio(sensor, states, scan):
    """Log of 1 - P_D + P_D sum p / lambda; without false alarms, of the likelihood."""
    seen = in_view(sensor, *measured(sensor, states)[:2])
    detection = np.where(seen, sensor.detection_probability, 0.0)
    plots = list(zip(*scan.plots, strict=True))
    with np.errstate(divide="ignore"):
        log_detection, log_missed = np.log(detection), np.log(1 - detection)
        terms = []
        for time_s, *plot in plots:
            term = log_detection + log_density(sensor, states, plot, time_s - scan.time_s)
            if sensor.false_alarms:
                _, width = sector(sensor)
                volume = (sensor.max_range_m - sensor.min_range_m) * width
                volume *= 1.0 if np.isnan(plot[-1]) else 2 * sensor.max_doppler_mps
                false = sensor.false_alarms / volume * relative_density(sensor, plot[0], plot[1])
                false += patched(sensor, plot[0], plot[1]) * (sensor.max_range_m - sensor.min_range_m) * width / volume
                term = term - np.log(false)
            terms.append(term)
    if sensor.false_alarms or not plots:
        terms.append(log_missed)
    return logsumexp(terms, axis=0)
