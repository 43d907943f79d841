#include "supernodal_tree.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>

#include "recent.hpp"
#include "strips.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

std::size_t at(std::int64_t i) {
  return static_cast<std::size_t>(i);
}

/// Fills a tree; `both` where U is stored too.
struct Builder {
  SupernodeTree& tree;
  const CscPattern& pattern;
  bool both;
  Index lanes;
  std::vector<Index> column, owner; // of each unknown its column, of each column its supernode

  void read(const Symbolic& s) {
    tree.order = s.order;
    tree.row = s.row;
    column.resize(s.order.size());
    owner.resize(s.order.size());
    for (std::size_t j = 0; j < s.order.size(); ++j)
      column[at(s.order[j])] = static_cast<Index>(j);
    for (std::size_t n = 0; n + 1 < s.first.size(); ++n) {
      Supernode node;
      node.first = s.first[n];
      node.columns = s.first[n + 1] - s.first[n];
      node.below = static_cast<Index>(s.start[n + 1] - s.start[n]);
      node.rows = s.start[n];
      std::fill_n(owner.begin() + node.first, node.columns, static_cast<Index>(n));
      tree.node.push_back(node);
    }
    tree.node.emplace_back();
    tree.node.back().rows = s.start.back();
  }

  Index strips_of(Index rows) const { return strips::whole(rows, lanes); }
  /// Where an entry of the lower triangle lies in its panel.
  std::int64_t offset(const Supernode& node, std::int64_t row, std::int64_t column) const {
    const std::int64_t k = node.columns, m = node.below;
    if (lanes == 0) return row + column * (k + m);
    if (row >= k) row += static_cast<std::int64_t>(strips_of(node.columns)) * lanes - k;
    return row / lanes * lanes * k + column * lanes + row % lanes;
  }
  std::int64_t update_entries(const Supernode& node) const {
    const std::int64_t m = node.below;
    return lanes > 0 ? strips::triangle(strips_of(node.below), lanes) : m * m;
  }

  void lay_panels() {
    for (Supernode& node : tree.node) {
      node.panel = tree.panels;
      const std::int64_t k = node.columns, m = node.below;
      tree.panels += lanes > 0 ? k * lanes * (strips_of(node.columns) + strips_of(node.below))
                               : k * (k + m) + (both ? k * m : 0);
      tree.tallest_product = std::max({tree.tallest_product, k * m, k * k / 4});
      if (std::max(k * (k + 2 * m), m * m) + (k + m) * lanes >
          std::numeric_limits<std::uint32_t>::max())
        throw NumericalError("a front of the factor exceeds 2³² entries; use a coarser mesh");
    }
  }

  void link() {
    tree.place.resize(tree.row.size());
    tree.child_start.assign(tree.node.size(), 0);
    for (Index s = 0; s < tree.size(); ++s) {
      Supernode& node = tree.node[at(s)];
      if (node.below == 0) continue;
      node.parent = owner[at(tree.row[at(node.rows)])];
      ++tree.child_start[at(node.parent) + 1];
      const Supernode& parent = tree.node[at(node.parent)];
      const Index* const rows = tree.row.data() + parent.rows;
      Index next = 0;
      for (Index i = 0; i < node.below; ++i) {
        const Index r = tree.row[at(node.rows + i)];
        const Index inside = r - parent.first;
        if (inside >= parent.columns)
          while (rows[next] != r)
            ++next;
        tree.place[at(node.rows + i)] = inside < parent.columns ? inside : parent.columns + next;
      }
    }
    std::partial_sum(tree.child_start.begin(), tree.child_start.end(), tree.child_start.begin());
    tree.child.resize(at(tree.child_start.back()));
    std::vector<Index> next(tree.child_start.begin(), tree.child_start.end() - 1);
    for (Index s = 0; s < tree.size(); ++s)
      if (tree.node[at(s)].parent >= 0) tree.child[at(next[at(tree.node[at(s)].parent)]++)] = s;
  }

  /// Supernode, row and column in L of the entry (r, c), or in Uᵀ.
  struct Place {
    Index node, row, column;
    bool upper;
  };
  Place place_of(std::int64_t r, std::int64_t c) const {
    const Index i = column[at(r)], j = column[at(c)];
    const Index s = owner[at(std::min(i, j))];
    if (pattern.lower) return {s, std::max(i, j), std::min(i, j), false};
    const bool upper = i < j && owner[at(j)] != s;
    return upper ? Place{s, j, i, true} : Place{s, i, j, false};
  }

  template <class Use>
  void for_entries(Use use) const {
    for (std::int64_t c = 0; c < pattern.size; ++c)
      for (std::int64_t e = pattern.start[at(c)]; e < pattern.start[at(c) + 1]; ++e)
        use(static_cast<std::uint32_t>(e), place_of(pattern.row[at(e)], c));
  }

  void place_entries() {
    for_entries([&](std::uint32_t, const Place& p) { ++tree.node[at(p.node) + 1].slots; });
    for (std::size_t s = 1; s < tree.node.size(); ++s)
      tree.node[s].slots += tree.node[s - 1].slots;
    tree.slot.resize(pattern.row.size());
    std::vector<std::size_t> next;
    for (const Supernode& node : tree.node)
      next.push_back(node.slots);
    std::vector<Place> found(tree.slot.size());
    for_entries([&](std::uint32_t e, const Place& p) {
      found[next[at(p.node)]] = p;
      tree.slot[next[at(p.node)]++].source = e;
    });
    std::vector<Index> local(at(pattern.size));
    for (Index s = 0; s < tree.size(); ++s) {
      const Supernode& node = tree.node[at(s)];
      for (Index i = 0; i < node.columns; ++i)
        local[at(node.first + i)] = i;
      for (Index i = 0; i < node.below; ++i)
        local[at(tree.row[at(node.rows + i)])] = node.columns + i;
      for (std::size_t e = node.slots; e < tree.node[at(s) + 1].slots; ++e) {
        const Place& p = found[e];
        const std::int64_t k = node.columns, m = node.below;
        const std::int64_t row = local[at(p.row)], column = p.column - node.first;
        tree.slot[e].target = static_cast<std::uint32_t>(
            p.upper ? k * (k + m) + row - k + column * m : offset(node, row, column));
      }
    }
  }

  /// Operations of each subtree, in units of a multiplication.
  std::vector<double> work() const {
    std::vector<double> total(at(tree.size()), 0.0);
    for (Index s = 0; s < tree.size(); ++s) {
      const Supernode& node = tree.node[at(s)];
      const double k = node.columns, m = node.below;
      total[at(s)] += k * (m * m + k * m + k * k / 3);
      if (node.parent >= 0) total[at(node.parent)] += total[at(s)];
    }
    return total;
  }

  /// Cut the heaviest subtrees open until none holds more than its share; the small ones stay.
  void cut(int branches) {
    const std::vector<double> total = work();
    double all = 0.0;
    for (Index s = 0; s < tree.size(); ++s)
      if (tree.node[at(s)].parent < 0) all += total[at(s)];
    const double share = branches > 1 ? all / branches : std::numeric_limits<double>::infinity();
    std::vector<Index> leftmost(at(tree.size()));
    for (Index s = 0; s < tree.size(); ++s) {
      const Index begin = tree.child_start[at(s)];
      leftmost[at(s)] =
          begin == tree.child_start[at(s) + 1] ? s : leftmost[at(tree.child[at(begin)])];
      const Index parent = tree.node[at(s)].parent;
      const bool whole = total[at(s)] <= share;
      if (!whole) {
        tree.trunk.push_back(s);
      } else if (parent < 0 || total[at(parent)] > share) {
        tree.branch.push_back({leftmost[at(s)], s + 1});
      }
    }
  }

  /// Updates live on two stacks, by the parity of their depth: a front is then made on one stack
  /// while its children lie on top of the other, and nothing moves. Each branch has its own two.
  void lay_updates() {
    std::vector<unsigned char> odd(at(tree.size()), 0);
    for (Index s = tree.size() - 1; s >= 0; --s)
      if (const Index p = tree.node[at(s)].parent; p >= 0) odd[at(s)] = !odd[at(p)];
    std::vector<Index> members;
    for (const Range& range : tree.branch) {
      members.resize(at(range.end - range.begin));
      std::iota(members.begin(), members.end(), range.begin);
      stack(members, odd);
    }
    stack(tree.trunk, odd);
  }

  void stack(const std::vector<Index>& members, const std::vector<unsigned char>& odd) {
    std::int64_t top[2] = {0, 0}, peak = 0;
    std::vector<unsigned char> mine(members.empty() ? 0 : at(members.back()) + 1, 0);
    for (const Index s : members) {
      mine[at(s)] = 1;
      Supernode& node = tree.node[at(s)];
      std::int64_t& own = top[odd[at(s)]];
      node.update = own;
      own += update_entries(node);
      peak = std::max(peak, top[0] + top[1]);
      for (Index c = tree.child_start[at(s)]; c < tree.child_start[at(s) + 1]; ++c) {
        const Supernode& child = tree.node[at(tree.child[at(c)])];
        if (mine[at(tree.child[at(c)])] != 0) top[!odd[at(s)]] -= update_entries(child);
      }
    }
    for (const Index s : members) { // the odd stack grows downwards from the end
      Supernode& node = tree.node[at(s)];
      if (odd[at(s)] != 0) node.update = peak - node.update - update_entries(node);
      node.update += tree.updates;
    }
    tree.updates += peak;
  }
};

/// The lower triangle of A + Aᵀ; the groups are kept.
CscPattern symmetric_lower(const CscPattern& full) {
  CscPattern transposed;
  transposed.start.assign(at(full.size) + 1, 0);
  for (const std::int64_t r : full.row)
    ++transposed.start[at(r) + 1];
  std::partial_sum(transposed.start.begin(), transposed.start.end(), transposed.start.begin());
  transposed.row.resize(full.row.size());
  std::vector<std::int64_t> next(transposed.start.begin(), transposed.start.end() - 1);
  for (std::int64_t c = 0; c < full.size; ++c)
    for (std::int64_t e = full.start[at(c)]; e < full.start[at(c) + 1]; ++e)
      transposed.row[at(next[at(full.row[at(e)])]++)] = c;
  CscPattern lower;
  lower.size = full.size;
  lower.lower = true;
  lower.group = full.group;
  lower.start.push_back(0);
  const auto below = [](const CscPattern& p, std::int64_t c) {
    const auto end = p.row.begin() + p.start[at(c) + 1];
    return std::make_pair(std::lower_bound(p.row.begin() + p.start[at(c)], end, c), end);
  };
  for (std::int64_t c = 0; c < full.size; ++c) {
    const auto [a, a_end] = below(full, c);
    const auto [b, b_end] = below(transposed, c);
    std::set_union(a, a_end, b, b_end, std::back_inserter(lower.row));
    lower.start.push_back(lower.nonzeros());
  }
  return lower;
}

} // namespace

TreeReport make_tree(const CscPattern& pattern, int branches, Index lanes) {
  TreeReport report{{}, shared_analysis(pattern.lower ? pattern : symmetric_lower(pattern))};
  Builder builder{report.tree, pattern, !pattern.lower, lanes, {}, {}};
  builder.read(report.analysis->symbolic);
  builder.lay_panels();
  builder.link();
  builder.place_entries();
  builder.cut(branches);
  builder.lay_updates();
  return report;
}

std::shared_ptr<const TreeReport> shared_tree(const CscPattern& pattern, int branches,
                                              Index lanes) {
  struct Known {
    CscPattern pattern;
    int branches;
    Index lanes;
    TreeReport report;
  };
  static Recent<Known> known;
  const std::shared_ptr<const Known> found = known.find(
      [&](const Known& one) {
        return one.branches == branches && one.lanes == lanes && one.pattern == pattern;
      },
      [&] {
        return std::make_shared<const Known>(
            Known{pattern, branches, lanes, make_tree(pattern, branches, lanes)});
      });
  return {found, &found->report};
}

} // namespace supple
