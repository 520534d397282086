"""Laws of hysteresis on one flow: Bouc-Wen, asymmetric, classical, play and stop operators, and their inverse."""
