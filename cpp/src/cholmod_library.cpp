#include "cholmod_library.hpp"

#include <utility>

#include "suitesparse.hpp"

namespace supple {

CholmodLibrary::CholmodLibrary(int supernodal) {
  cholmod_l_start(&common);
  common.print = 0;
  common.error_handler = nullptr;
  common.supernodal = supernodal;
  common.final_ll = 0;
  common.quick_return_if_not_posdef = 1;
  common.nmethods = 1;
  common.method[0].ordering = CHOLMOD_GIVEN;
  common.postorder = 1;
#if CHOLMOD_MAIN_VERSION >= 5
  common.nthreads_max = 1;
#endif
}

CholmodLibrary::~CholmodLibrary() {
  release();
  cholmod_l_finish(&common);
}

void CholmodLibrary::release() {
  cholmod_l_free_factor(&factor, &common);
  for (cholmod_dense** d : {&x, &y, &e})
    cholmod_l_free_dense(d, &common);
}

void CholmodLibrary::require_ok(const char* stage) const {
  if (common.status >= CHOLMOD_OK) return;
  const bool memory = common.status == CHOLMOD_OUT_OF_MEMORY || common.status == CHOLMOD_TOO_LARGE;
  throw library_error("CHOLMOD", stage, common.status, memory);
}

void CholmodLibrary::analyse(const CscPattern& lower) {
  const SerialOpenMp serial;
  release();
  cholmod_sparse matrix = lower_view(lower.start, lower.row);
  const GroupGraph graph(lower);
  GroupOrders orders(graph);
  keep_if_better(matrix, graph.expand(orders.amd()), "AMD");
  if (orders.metis()) keep_if_better(matrix, graph.expand(orders.order), "METIS");
  if (factor == nullptr) require_ok("analysis");
}

GroupOrders::GroupOrders(const GroupGraph& graph)
    : order(graph.start.size() - 1), nodes_(lower_view(graph.start, graph.row)) {}

const std::vector<std::int64_t>& GroupOrders::amd() {
  cholmod_l_amd(&nodes_, nullptr, 0, as_long(order), &library_.common);
  library_.require_ok("ordering");
  return order;
}

bool GroupOrders::metis() {
#ifndef NPARTITION
  const SerialOpenMp serial;
  return cholmod_l_metis(&nodes_, nullptr, 0, 1, as_long(order), &library_.common) != 0;
#else
  return false;
#endif
}

void CholmodLibrary::keep_if_better(cholmod_sparse& matrix, std::vector<std::int64_t> order,
                                    const char* name) {
  cholmod_factor* found = cholmod_l_analyze_p(&matrix, as_long(order), nullptr, 0, &common);
  if (found != nullptr && (factor == nullptr || common.fl < flops)) {
    std::swap(found, factor);
    flops = common.fl;
    nonzeros = common.lnz;
    ordering = name;
  }
  cholmod_l_free_factor(&found, &common);
}

cholmod_sparse lower_view(const std::vector<std::int64_t>& start,
                          const std::vector<std::int64_t>& row) {
  cholmod_sparse a{};
  a.nrow = a.ncol = start.size() - 1;
  a.nzmax = row.size();
  a.p = const_cast<std::int64_t*>(start.data());
  a.i = const_cast<std::int64_t*>(row.data());
  a.stype = -1;
  a.itype = CHOLMOD_LONG;
  a.xtype = CHOLMOD_PATTERN;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = 1;
  return a;
}

} // namespace supple
