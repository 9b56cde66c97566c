"""Modal solver: bars by their normal modes, contact and rock step by step."""
