"""Parts of a drilling system, each a plain model; `part` makes a slave of any of them."""
