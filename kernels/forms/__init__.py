"""Weak forms: each module gives, for one kind of term, its kernels as UFL objects by name."""
