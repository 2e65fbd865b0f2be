"""Counterparts of published methods, and of our chain in torch, trained and measured on the same data as ours."""
