/// Direct solvers for the reduced matrix: one symbolic analysis, many factorisations, many solves.
///
///     Reduction reduction = reduce(pattern, free, storage(kind));
///     Factor factor(kind);
///     factor.analyse(reduction.pattern);
///     reduction.gather(values, reduced);
///     if (FactorStatus status = factor.factorise(reduced); status.ok()) factor.solve(rhs, x);
///
/// 64-bit offsets throughout: a factor of a 3-D body has 10² to 10³ times the entries of its matrix
/// and passes 2³¹ entries (16 GB) where the matrix itself is far from it.
///
/// The multifrontal factors do not choose their pivots beyond a front. What that spoils, refinement
/// repairs; where it does not, Factor falls back to UMFPACK, whose verdict and answer then count.
/// In the same way a factor in single precision falls back to one in double: where a pivot is not
/// positive, or where refinement does not reach what is asked.
#pragma once

#include <memory>

#include "supple/sparse.hpp"

namespace supple {

/// What is known about the matrix, by the origin of its terms and never by trial.
enum class Kind {
  Cholesky,      ///< symmetric positive definite: multifrontal LLᵀ
  QuasiDefinite, ///< symmetric indefinite: multifrontal LDLᵀ without pivoting, refined
  Unsymmetric    ///< multifrontal LU with partial pivoting inside a front, refined
};

/// The numbers that a factor of kind Cholesky is kept in.
enum class Precision {
  Double,
  Single ///< half the memory and time; `solve` refines by conjugate gradients in double
};

/// Whose factorisations.
enum class Library {
  Own,    ///< the runtime's
  Pardiso ///< MKL's, always in double precision: see pardiso.hpp
};

/// Which part of the reduced matrix a factor of this kind reads.
inline Storage storage(Kind kind) {
  return kind == Kind::Unsymmetric ? Storage::Full : Storage::Lower;
}

/// Outcome of a factorisation; a matrix that cannot be factorised is an answer, not an exception.
struct FactorStatus {
  enum class Cause { None, NotPositiveDefinite, Singular, NotFinite };
  Cause cause = Cause::None;
  std::int64_t unknown = -1; ///< the unknown at which it failed (row of the reduced matrix), or −1

  bool ok() const { return cause == Cause::None; }
};

/// Signs of the pivots of LDLᵀ, which are those of the eigenvalues (Sylvester).
struct Inertia {
  std::int64_t negative = 0, zero = 0, positive = 0;
  double growth =
      0.0; ///< max (|L||D||Lᵀ|)ᵢᵢ / max |A|: 1 is ideal, above ~1e8 the signs are doubtful
};

/// When iterative refinement stops; it always stops when the residual no longer halves.
struct Refinement {
  /// ‖b − Ax‖₂ ≤ tolerance·‖b‖₂; 0 asks for rounding: ‖b − Ax‖∞ ≤ ε (‖A‖∞‖x‖∞ + ‖b‖∞).
  double tolerance = 0.0;
  int max_steps = 10;
};

/// What a solve did.
struct SolveReport {
  double residual = 0.0; ///< ‖b − Ax‖₂ / ‖b‖₂ at the returned x; 0 where b = 0
  double backward = 0.0; ///< ‖b − Ax‖∞ / (‖A‖∞‖x‖∞ + ‖b‖∞)
  int steps = 0;         ///< refinement steps kept, or conjugate gradients
};

/// A factorisation of one kind; not to be used by two threads at once.
class Factor {
 public:
  /// @param precision of a factor of kind Cholesky; the others are always double.
  /// @throws StateError if `library` is Pardiso and was not loaded.
  explicit Factor(Kind kind, Precision precision = Precision::Double,
                  Library library = Library::Own);
  Factor(Factor&&) noexcept;
  Factor& operator=(Factor&&) noexcept;
  ~Factor();

  /// Order and symbolically factorise; kept until the next analyse.
  ///
  /// AMD and METIS on the graph of the groups; the one with fewer flops is kept.
  /// @throws ShapeError if the pattern's storage does not fit the kind; NumericalError out of
  /// memory.
  void analyse(const CscPattern& pattern);

  /// Numeric factorisation of the values (pattern.nonzeros()) on the analysed pattern.
  /// @throws StateError before analyse; ShapeError on a wrong size; NumericalError out of memory.
  FactorStatus factorise(const ConstVector& values);

  /// x = A⁻¹ rhs, refined with the values of the last factorise.
  ///
  /// A factor in single precision is refined by conjugate gradients, at most 3·max_steps of them.
  /// Where refinement of a factor without pivoting, or in single precision, ends neither at the
  /// tolerance (1e-12 at least) nor at rounding, the reserve factorises the same values and the
  /// better answer is kept. With `max_steps` = 0 the factor is taken as it is.
  /// @throws StateError unless the last factorise was ok; ShapeError on a wrong size.
  SolveReport solve(const ConstVector& rhs, MutableVector x, const Refinement& refinement = {});

  /// x = A⁻¹ rhs as the factor gives it, neither refined nor measured: a preconditioner.
  /// @throws StateError unless the last factorise was ok; ShapeError on a wrong size.
  void apply_inverse(const ConstVector& rhs, MutableVector x);

  /// Of LDLᵀ also after a fall-back; `growth` then says that they are doubtful.
  /// @throws StateError unless the kind is QuasiDefinite and the last factorise was ok.
  Inertia inertia() const;

  /// The last factorise or solve had to fall back: to double precision, or to UMFPACK.
  bool fell_back() const;

  Precision precision() const; ///< as asked for
  Kind kind() const;
  std::int64_t size() const;    ///< number of unknowns
  double flops() const;         ///< of one factorisation, as the analysis counts them
  double nonzeros() const;      ///< entries of L, or of L + U
  const char* ordering() const; ///< "AMD", "METIS", … that the analysis kept

 private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace supple
