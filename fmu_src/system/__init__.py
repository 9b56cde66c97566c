"""Archives of whole systems of FMUs (SSP)."""
