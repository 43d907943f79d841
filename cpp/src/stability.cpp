#include "supple/stability.hpp"

#include "supple/error.hpp"

namespace supple {

namespace {

constexpr double kDoubtful = 1e8; // growth of LDLᵀ above which the signs of its pivots mean little

} // namespace

std::int64_t unstable_directions(System& system, const ConstVector& u, const System* inverse) {
  if (system.kind() == Kind::Unsymmetric)
    throw StateError("stability needs loads with an energy; a pressure that follows has none");
  system.assemble_tangent(u, 1.0);
  if (system.kind() == Kind::QuasiDefinite)
    return system.factorise().ok() ? unstable_directions_of_saddle(system) : 1;
  if (inverse != nullptr && system.definite_beside(*inverse)) return 0;
  return system.inertia().negative; // of LDLᵀ, whose analysis the inverse form has made already
}

std::int64_t unstable_directions_of_saddle(System& system) {
  const Inertia inertia = system.inertia();
  return inertia.growth > kDoubtful ? 0 : inertia.negative - system.scalars();
}

} // namespace supple
