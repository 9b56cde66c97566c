"""Examples, one question each: `python -m examples.NAME`; docs/gallery.md shows them."""
