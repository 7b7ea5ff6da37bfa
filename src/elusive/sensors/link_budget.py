"""Received power of a link in free space, and how attenuation falls off with distance.

Mendieta (2017), eqs. 3.1-3.5. Eq. 3.2 is a ratio there; in the sum of eq. 3.1 it stands in decibels (Friis, 1946).
Eq. 3.3 is printed without the minus sign that figure 3.3 has.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import Model, NonNegative, Positive

LIGHT_MPS = 299_792_458.0


class LinkBudget(Model):
    """Power, gains and losses of a link with line of sight, eq. 3.1."""

    transmitted_dbm: float = Field(0.0, description="Transmitted power, P_TX [dBm]")
    transmitter_gain_db: float = Field(0.0, description="Gain of the transmitter's antenna, G_TX [dB]")
    receiver_gain_db: float = Field(0.0, description="Gain of the receiver's antenna, G_RX [dB]")
    transmitter_loss_db: NonNegative = Field(0.0, description="Loss in the transmitter, L_TX [dB]")
    receiver_loss_db: NonNegative = Field(0.0, description="Loss in the receiver, L_RX [dB]")
    other_loss_db: float = Field(0.0, description="Polarisation, absorption, fading margin ..., L_M [dB]")
    frequency_hz: Positive = Field(2.45e9, description="Carrier frequency; the wavelength is c over it [Hz]")

    @property
    def wavelength_m(self) -> float:
        """Wavelength, lambda [m]."""
        return LIGHT_MPS / self.frequency_hz

    def free_space_loss_db(self, distance_m: ArrayLike) -> Array:
        """Return ``20 log10(4 pi R / lambda)`` for each distance, eq. 3.2.

        Raises
        ------
        DataError
            If a distance is not above zero.
        """
        distance = np.asarray(distance_m, dtype=np.float64)
        if not (np.isfinite(distance).all() and (distance > 0).all()):
            raise DataError("distance: must be above zero and finite; give the metres between the two antennas.")
        loss: Array = 20.0 * np.log10(4.0 * math.pi * distance / self.wavelength_m)
        return loss

    def received_dbm(self, distance_m: ArrayLike) -> Array:
        """Return the received power at each distance, eq. 3.1 [dBm].

        Raises
        ------
        DataError
            If a distance is not above zero.
        """
        gains = self.transmitter_gain_db + self.receiver_gain_db
        losses = self.transmitter_loss_db + self.receiver_loss_db + self.other_loss_db
        received: Array = self.transmitted_dbm + gains - losses - self.free_space_loss_db(distance_m)
        return received


def exponential_attenuation(distance_m: ArrayLike, rate_per_m: float) -> Array:
    """Return ``exp(-lambda x)``, eq. 3.3.

    Raises
    ------
    ParameterError
        If the rate is not above zero.
    """
    _check_above_zero(rate_per_m=rate_per_m)
    attenuation: Array = np.exp(-rate_per_m * np.asarray(distance_m, dtype=np.float64))
    return attenuation


def power_law_attenuation(distance_m: ArrayLike, rate_per_m: float, exponent: float) -> Array:
    """Return ``1 / sqrt(1 + (lambda x)^alpha)``, eq. 3.4.

    Raises
    ------
    ParameterError
        If the rate or the exponent is not above zero.
    """
    _check_above_zero(rate_per_m=rate_per_m, exponent=exponent)
    attenuation: Array = 1.0 / np.sqrt(1.0 + (rate_per_m * np.asarray(distance_m, dtype=np.float64)) ** exponent)
    return attenuation


def gaussian_attenuation(distance_m: ArrayLike, sd_m: float, mean_m: float = 0.0) -> Array:
    """Return ``exp(-(x - mu)^2 / (2 sigma^2))``, eq. 3.5.

    Raises
    ------
    ParameterError
        If the deviation is not above zero.
    """
    _check_above_zero(sd_m=sd_m)
    attenuation: Array = np.exp(-0.5 * ((np.asarray(distance_m, dtype=np.float64) - mean_m) / sd_m) ** 2)
    return attenuation


def _check_above_zero(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise ParameterError(f"{name}: must be above zero and finite (got {value!r}).")
