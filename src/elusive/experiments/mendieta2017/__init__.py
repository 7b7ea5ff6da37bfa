"""Mendieta (2017), Multiple target localization and tracking in a wireless sensor network: chapter 4."""
