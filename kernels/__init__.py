"""The kernel generator: a strain energy in, C kernels out (UFL, FFCx, Basix).

    tensors     operations on UFL expressions and on numbers alike
    energy      the words that an energy file may use
    functions   functions that UFL and C lack: a frozen value, the exponential integral
    spectral    sums over principal stretches, smooth where they coincide
    kinematics  what `k` offers: F, C, invariants, stretch tensor
    membrane_kinematics  the same of a membrane
    law         a strain energy as read: parameters and functions
    reader      an energy file, read with ast and checked before it runs
    cells       node and facet numbers of every element, in files and in kernels
    degree      quadrature degrees and schemes that there are
    elements    Basix elements and the pinned quadrature
    forms/      weak forms: volume, loads, membrane
    unit        the name of one kernel library, such as neo_hookean.P1.direct
    parts       a long kernel as several functions
    fingerprint the mark by which a library is known to be of this generator
    represent   FFCx's intermediate representation of forms
    simd/       FFCx's graph as C on vectors of cells
    targets     processors that kernels are compiled ahead for
    generate    unit → C source with its kernel table
    build       C source → shared library, kept in the user's cache
    ahead       the units that CMake compiles

Only `reader`, `unit`, `cells`, `degree`, `fingerprint`, `targets` and `build` are needed to find a
library that exists: they import neither UFL nor FFCx.
"""
