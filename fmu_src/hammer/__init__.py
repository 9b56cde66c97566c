"""The hammer: its variables and their readers, its motion, the slave around it."""
