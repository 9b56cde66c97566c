"""Makes the FMUs that surround the hammer, and archives of whole systems."""
