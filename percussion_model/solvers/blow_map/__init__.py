"""A table of blows, and closed-form flight between them."""
