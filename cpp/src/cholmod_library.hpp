/// CHOLMOD's settings, orderings and symbolic factors; private to the runtime.
#pragma once

#include <cholmod.h>
#include <omp.h>

#include <cstdint>
#include <vector>

#include "group_graph.hpp"

namespace supple {

/// Keeps CHOLMOD from opening OpenMP threads of its own, which would fight for the cores with ours.
/// Before CHOLMOD 5 their number (4) is compiled in and only the nesting limit holds it; from
/// CHOLMOD 5 on Common.nthreads_max does.
struct SerialOpenMp {
#if CHOLMOD_MAIN_VERSION < 5
  int levels = omp_get_max_active_levels();
  SerialOpenMp() { omp_set_max_active_levels(0); }
  ~SerialOpenMp() { omp_set_max_active_levels(levels); }
#else
  SerialOpenMp() {}
  ~SerialOpenMp() {}
#endif
  SerialOpenMp(const SerialOpenMp&) = delete;
  SerialOpenMp& operator=(const SerialOpenMp&) = delete;
};

/// CHOLMOD's settings, work space and results, freed in the right order.
struct CholmodLibrary {
  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense* x = nullptr;
  cholmod_dense* y = nullptr;
  cholmod_dense* e = nullptr;
  double flops = 0.0, nonzeros = 0.0; ///< of the factor that the analysis kept
  const char* ordering = "none";

  /// @param supernodal CHOLMOD_SUPERNODAL or CHOLMOD_SIMPLICIAL.
  explicit CholmodLibrary(int supernodal);
  ~CholmodLibrary();
  CholmodLibrary(const CholmodLibrary&) = delete;
  CholmodLibrary& operator=(const CholmodLibrary&) = delete;

  /// Order a lower triangle by AMD and by METIS on the graph of its groups, and keep the symbolic
  /// factor with fewer flops.
  void analyse(const CscPattern& lower);
  void release();
  /// A negative status is an error; a positive one (not positive definite) is an answer.
  void require_ok(const char* stage) const;

 private:
  void keep_if_better(cholmod_sparse& matrix, std::vector<std::int64_t> order, const char* name);
};

/// Orders of the groups of a pattern.
class GroupOrders {
 public:
  explicit GroupOrders(const GroupGraph& graph);
  std::vector<std::int64_t> order; ///< (groups) the one found last
  /// Approximate minimum degree. @throws NumericalError out of memory.
  const std::vector<std::int64_t>& amd();
  /// Nested dissection; false where CHOLMOD was built without METIS or that failed.
  bool metis();

 private:
  CholmodLibrary library_{CHOLMOD_SIMPLICIAL};
  cholmod_sparse nodes_;
};

/// CHOLMOD's header on a lower triangle of ours; CHOLMOD does not write through it.
cholmod_sparse lower_view(const std::vector<std::int64_t>& start,
                          const std::vector<std::int64_t>& row);

} // namespace supple
