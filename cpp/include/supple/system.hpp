/// All terms of one body on shared dofs, with pattern, reduction and factor kept between solves.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "supple/inverse_solver.hpp"
#include "supple/linear.hpp"
#include "supple/multigrid.hpp"
#include "supple/symmetric_solver.hpp"
#include "supple/term.hpp"

namespace supple {

/// Seconds spent in the phases of a solve, and how often its costly parts were done.
struct Timings {
  double analysis = 0.0; ///< pattern, scatter map, ordering and symbolic factor
  double residual = 0.0; ///< residuals, energies and volume ratios
  double assembly = 0.0, factor = 0.0, solve = 0.0, total = 0.0;
  int factorisations = 0, krylov_iterations = 0;
};

/// How the tangents of a symmetric positive definite body are solved with.
enum class Method {
  Direct,  ///< a factor of each
  Pardiso, ///< the same by MKL, of other kinds of tangents too
  Kept,    ///< conjugate gradients on a factor that is kept while it serves
  Grid     ///< conjugate gradients on multigrid; the whole matrix is never factorised
};

class System {
 public:
  /// @param points (3n) coordinates of the mesh, m, node-major.
  /// @param home (scalars) the node whose neighbours each scalar unknown shares.
  explicit System(std::shared_ptr<Vector> points, std::vector<Index> home = {});

  ~System();

  /// Add a term; the pattern is made anew at the next use.
  void add(std::shared_ptr<Term> term);
  /// Which dofs are free; the reduction and the symbolic factor are made anew if it changes.
  /// @throws ShapeError on a wrong size.
  void set_free(Mask free);

  /// Solve with unsymmetric tangents, which are those of an inverse form, by GMRES instead of LU;
  /// to be called before each run, which starts from no factor of an earlier one.
  void use_gmres(bool gmres);
  /// Solve so where factors may be kept (`prepare`) and the kind is Cholesky; what is kept is let
  /// go of when the method changes, or with forget_kept.
  /// @throws StateError if MKL was not loaded (pardiso.hpp).
  void use_method(Method method);
  void forget_kept();
  /// What Method::Grid makes its levels of: see Multigrid.
  void use_grid(Corners corners, Aggregate aggregate);
  /// Whether tangents are solved with by multigrid, which knows no inertia of indefinite ones.
  bool has_grid() const { return method_ == Method::Grid && kind() == Kind::Cholesky; }

  Index scalars() const { return static_cast<Index>(home_.size()); }
  Index dofs() const { return static_cast<Index>(points_->size()) + scalars(); }
  std::shared_ptr<const Vector> points() const { return points_; }
  /// Move the mesh under all terms of a direct system; pattern and symbolic factors stay. What a
  /// term keeps of the old points goes when its fields are set anew, as they must be.
  /// @throws ShapeError on a wrong size.
  void move_points(const ConstVector& points);
  /// All terms have a potential, so energy() is that of residual().
  bool has_energy() const;
  /// By the origin of the terms: Unsymmetric where one is, QuasiDefinite with scalars, else
  /// Cholesky.
  Kind kind() const;

  /// Potential energy, loads scaled by `load_factor`, J.
  double energy(const ConstVector& u, double load_factor) const;
  /// R (dofs), N, loads scaled.
  Vector residual(const ConstVector& u, double load_factor) const;
  /// The same into `r` (dofs), which takes no memory.
  void residual(const ConstVector& u, double load_factor, MutableVector r) const;
  /// R, and `external` = external(u) beside it, each load evaluated once.
  Vector residual_beside(const ConstVector& u, double load_factor, Vector& external) const;
  /// External force alone, −R of the loads at factor 1 (dofs), N.
  Vector external(const ConstVector& u) const;
  VolumeRatio volume_ratio(const ConstVector& u) const;

  /// Which nodes the terms couple.
  const NodeGraph& graph();
  /// CSR pattern of all dofs; symmetric kinds need it for full_tangent() only.
  const BlockPattern& pattern();
  const Reduction& reduction();
  /// K at u: of symmetric kinds straight into the values of reduction().pattern, else in CSR.
  void assemble_tangent(const ConstVector& u, double load_factor);
  /// Values on reduction().pattern of the tangent last assembled, plus `shift` times the mean size
  /// of their diagonal.
  const Vector& reduced_tangent(double shift = 0.0);
  /// CSR values on pattern() of the tangent last assembled; of symmetric kinds made when asked for.
  const Vector& full_tangent();

  /// Factorise the reduced tangent last assembled, plus `shift` times its diagonal's mean size.
  FactorStatus factorise(double shift = 0.0);
  /// The same without asking it to be positive definite (symmetric kinds only).
  FactorStatus factorise_indefinite();
  /// Flops and entries of a Cholesky factor of the reduced tangent, as its analysis counts them;
  /// the analysis is kept.
  std::pair<double, double> predicted_factor();
  /// Make ready to solve with the reduced tangent last assembled, if need be on the factor of an
  /// earlier one (Method::Kept); else as factorise() does.
  FactorStatus prepare();
  /// x (dofs), 0 at fixed ones, from the last factor; `rhs` (dofs).
  /// @param tolerance of the residual over that of x = 0, which an iteration need not fall below.
  /// @param probe find out, too, whether the tangent is positive definite, where that is unknown.
  /// x is not finite where GMRES and then LU, or LDLᵀ, found the tangent singular.
  Vector solve(const ConstVector& rhs, double tolerance = 1e-10, bool probe = false);
  /// What is known of the signs of the eigenvalues of the tangent last prepared or factorised.
  Definite definite() const;
  /// The same, but find out where it is unknown: by iterations or by a factor, whichever costs
  /// less.
  Definite find_definite();
  /// Whether conjugate gradients on the factor that `inverse` keeps, the inverse form of the same
  /// body, show that the tangent last assembled is positive definite. That factor is of the body
  /// without strain, in the same place. False where it does not serve, or there is none.
  bool definite_beside(const System& inverse);
  /// (values of K)·x on all dofs, from the tangent last assembled.
  Vector apply(const ConstVector& x);
  /// The step d (dofs) from `u`, its free nodes on arcs: NodeRotations::along_arcs.
  Vector along_arcs(const ConstVector& u, const ConstVector& d);
  /// Signs of the eigenvalues of the reduced tangent last assembled (symmetric kinds only); of a
  /// quasi-definite one those of its last factor.
  /// With Method::Grid only whether one is negative: 1, or 0.
  Inertia inertia();

  mutable Timings timings; ///< of what only asks, too

 private:
  bool iterates() const { return gmres_ && kind() == Kind::Unsymmetric; }
  bool keeps() const {
    return (method_ == Method::Kept || method_ == Method::Grid) && kind() == Kind::Cholesky;
  }
  std::unique_ptr<Factor> analysed(Kind kind);
  FactorStatus prepare_inverse();
  SymmetricSolver& symmetric();
  const NodeRotations& rotations();
  void solve_kept(const Vector& rhs, double tolerance, bool probe, Vector& x);
  void count_work();
  void count_kept();
  void forget_factors();
  std::vector<Connectivity> connectivities() const;
  void assemble_full();
  std::size_t add_with_another(std::size_t t, const std::vector<bool>& done);

  std::shared_ptr<Vector> points_;
  std::vector<Index> home_;
  std::vector<std::shared_ptr<Term>> terms_;
  Mask free_;
  std::unique_ptr<NodeGraph> graph_;
  std::unique_ptr<BlockPattern> pattern_;
  std::unique_ptr<Reduction> reduction_;
  std::vector<LowerScatter> lower_; // of each term, where the kind is symmetric
  std::unique_ptr<Factor> factor_, indefinite_;
  Factor* current_ = nullptr;             // the one that factorised last
  Definite definite_ = Definite::Unknown; // of what current_ factorised
  std::unique_ptr<InverseSolver> inverse_;
  bool gmres_ = false;
  std::unique_ptr<NodeRotations> rotations_; // outlives symmetric_
  std::unique_ptr<SymmetricSolver> symmetric_;
  Method method_ = Method::Direct;
  Corners corners_;
  Aggregate aggregate_;
  Vector lower_values_, values_, reduced_;
  Vector at_;                 // u of the tangent last assembled
  double load_factor_ = 0.0;  // and its loads
  bool full_is_made_ = false; // values_ are of it
};

} // namespace supple
