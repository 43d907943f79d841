"""What a material author needs: a law's curves, its properties, and its fit to tests.

    energy file ─► points (compiled kernels) ─► modes (tests on a cube) ─► curves, properties, fit

Stresses are those of the law's own kernels: what is drawn and fitted is what a body is solved with.
"""
