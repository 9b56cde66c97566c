"""Command line, figures and pages."""
