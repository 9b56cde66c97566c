"""Rigid piston and bit, from event to event in closed form."""
