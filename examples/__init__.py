"""Examples, one question each: `python -m examples.NAME`; docs/data/gallery.md shows them."""
