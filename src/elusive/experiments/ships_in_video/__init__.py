"""Ships in radar video against their SNR: near a coast and off it, with its chart and without."""
