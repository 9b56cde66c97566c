"""Pages and figures that `python -m docs.make` makes, a module each."""
