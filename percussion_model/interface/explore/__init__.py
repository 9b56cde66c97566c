"""A page that runs the hammer in a browser: its sources, and how they become one file."""
