/// Fill-reducing orders of a group graph, by CHOLMOD's AMD and METIS; private to the runtime.
#pragma once

#include <cholmod.h>

#include <cstdint>
#include <vector>

#include "group_graph.hpp"

namespace supple {

/// Orders of the groups of a pattern.
class GroupOrders {
 public:
  explicit GroupOrders(const GroupGraph& graph);
  ~GroupOrders();
  GroupOrders(const GroupOrders&) = delete;
  GroupOrders& operator=(const GroupOrders&) = delete;

  std::vector<std::int64_t> order; ///< (groups) the one found last
  /// Approximate minimum degree. @throws NumericalError out of memory.
  const std::vector<std::int64_t>& amd();
  /// Nested dissection; false where CHOLMOD was built without METIS or that failed.
  bool metis();

 private:
  cholmod_common common_;
  cholmod_sparse graph_{};
};

} // namespace supple
