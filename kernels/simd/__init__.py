"""Kernels of W cells a call: FFCx's scalar graph as C whose varying scalars are vectors.

    body         FFCx's intermediate representation → the body of one C function
    tables       values of shape functions at the points, uniform numbers
    terminals    coordinates, unknowns and their derivatives at a point
    straight     the scalar graph: what is used, powers and divisions shared, as C
    gradients    tangents through the derivative of stress
    linear       coefficients of linear forms by sweeps backwards
    contraction  sums over shape functions and points into the element's tensor
    solid        tangents on loaded shapes: geometry by hand around the graph of the law alone
    point_law    that graph, as a function of F and the parameters
    lanes        how many cells a call, and the C that every such kernel begins with
    *.h          vector functions

Which kernel is made how, the first that fits (generate._Compiler):

    tangent of a solid's inverse form     solid and point_law, where ψ looks at F alone
    other tangents by gradients alone     gradients and linear: direct, mean dilatation, and the
                                          inverse of a law that looks at the cell's edges
    all other forms                       body and contraction, the arguments factored by FFCx:
                                          mixed, skins, pressures; every residual and energy
    values at points                      body

A vector is `vec`, LANES doubles (vector extensions of GCC and Clang); a truth is a `mask` of LANES
integers, all bits or none; conditions choose lane by lane, so no lane ever sees another's numbers.
What is the same for all cells stays a double.
"""
