"""FMUs made of the package: variables, model description, bundled sources, archive."""
