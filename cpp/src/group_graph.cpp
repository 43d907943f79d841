#include "group_graph.hpp"

#include <algorithm>

namespace supple {
namespace {

std::vector<std::int64_t> number_groups(const CscPattern& pattern,
                                        std::vector<std::vector<std::int64_t>>& unknowns) {
  const auto n = static_cast<std::size_t>(pattern.size);
  std::vector<std::int64_t> group(n);
  Index most = 0;
  for (Index g : pattern.group)
    most = std::max(most, g);
  std::vector<std::int64_t> known(static_cast<std::size_t>(most) + 1, -1);
  for (std::size_t u = 0; u < n; ++u) {
    std::int64_t fresh = -1;
    std::int64_t& id =
        pattern.group.empty() ? fresh : known[static_cast<std::size_t>(pattern.group[u])];
    if (id < 0) {
      id = static_cast<std::int64_t>(unknowns.size());
      unknowns.emplace_back();
    }
    group[u] = id;
    unknowns[static_cast<std::size_t>(id)].push_back(static_cast<std::int64_t>(u));
  }
  return group;
}

} // namespace

GroupGraph::GroupGraph(const CscPattern& pattern) {
  const std::vector<std::int64_t> group = number_groups(pattern, unknowns);
  const auto leads = [&](std::int64_t u) {
    return unknowns[static_cast<std::size_t>(group[static_cast<std::size_t>(u)])].front() == u;
  };
  for (const std::vector<std::int64_t>& members : unknowns) {
    const auto c = static_cast<std::size_t>(members.front());
    for (std::int64_t k = pattern.start[c]; k < pattern.start[c + 1]; ++k) {
      const std::int64_t r = pattern.row[static_cast<std::size_t>(k)];
      if (leads(r)) row.push_back(group[static_cast<std::size_t>(r)]);
    }
    start.push_back(static_cast<std::int64_t>(row.size()));
  }
}

std::vector<std::int64_t> GroupGraph::expand(const std::vector<std::int64_t>& order) const {
  std::vector<std::int64_t> all;
  for (std::int64_t g : order) {
    const std::vector<std::int64_t>& members = unknowns[static_cast<std::size_t>(g)];
    all.insert(all.end(), members.begin(), members.end());
  }
  return all;
}

} // namespace supple
