"""The commands of `percussion`, a module each or a few that belong together."""
