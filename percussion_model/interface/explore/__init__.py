"""The explorer: an interactive page on which the response follows sliders."""
