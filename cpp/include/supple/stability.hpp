/// Is an equilibrium one that a body rests in?
#pragma once

#include "supple/system.hpp"

namespace supple {

/// Directions in which a small push makes the body leave `u` (dofs) under the whole load: negative
/// eigenvalues of K, less the one that belongs to each scalar. One factorisation, two if K is
/// indefinite; none where the factor that `inverse`, the inverse form of the same body, keeps shows
/// that there are none. An answer in doubt (a scalar's pivots grown too large) is 0.
/// @throws StateError where a load has no energy: the signs of an unsymmetric K say little.
std::int64_t unstable_directions(System& system, const ConstVector& u,
                                 const System* inverse = nullptr);

/// The same of the tangent that the system factorised last, where it has scalars.
std::int64_t unstable_directions_of_saddle(System& system);

} // namespace supple
