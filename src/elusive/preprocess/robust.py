"""Deviation of a Gaussian over its median absolute deviation, 1 over .6745 (Rousseeuw and Croux 1993, JASA 88)."""

MAD = 1.4826
