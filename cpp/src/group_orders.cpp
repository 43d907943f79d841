#include "group_orders.hpp"

#include "suitesparse.hpp"

namespace supple {
namespace {

/// CHOLMOD's header on a graph of ours; CHOLMOD does not write through it.
cholmod_sparse lower_view(const GroupGraph& graph) {
  cholmod_sparse a{};
  a.nrow = a.ncol = graph.start.size() - 1;
  a.nzmax = graph.row.size();
  a.p = const_cast<std::int64_t*>(graph.start.data());
  a.i = const_cast<std::int64_t*>(graph.row.data());
  a.stype = -1;
  a.itype = CHOLMOD_LONG;
  a.xtype = CHOLMOD_PATTERN;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = 1;
  return a;
}

} // namespace

GroupOrders::GroupOrders(const GroupGraph& graph)
    : order(graph.start.size() - 1), graph_(lower_view(graph)) {
  cholmod_l_start(&common_);
  common_.print = 0;
  common_.error_handler = nullptr;
}

GroupOrders::~GroupOrders() {
  cholmod_l_finish(&common_);
}

const std::vector<std::int64_t>& GroupOrders::amd() {
  cholmod_l_amd(&graph_, nullptr, 0, as_long(order), &common_);
  if (common_.status < CHOLMOD_OK) {
    const int status = common_.status;
    const bool memory = status == CHOLMOD_OUT_OF_MEMORY || status == CHOLMOD_TOO_LARGE;
    throw library_error("CHOLMOD", "ordering", status, memory);
  }
  return order;
}

bool GroupOrders::metis() {
#ifndef NPARTITION
  return cholmod_l_metis(&graph_, nullptr, 0, 1, as_long(order), &common_) != 0;
#else
  return false;
#endif
}

} // namespace supple
