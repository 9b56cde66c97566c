"""Rock from drilling data: a filter along the hole, and what it can tell."""
