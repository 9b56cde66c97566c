"""The equations that every solver shares, each once."""
