"""Hysteresis curves: records, metrics, Bouc-Wen laws and their identification. No tube, no solver."""
