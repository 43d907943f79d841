#include "symbolic.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace supple {
namespace {

std::size_t at(std::int64_t i) {
  return static_cast<std::size_t>(i);
}

/// Seconds that a front of k columns and m rows below takes, about: products by whole vectors, the
/// update's way to its parent, and what every front costs. Only ratios count.
double cost(double k, double m) {
  constexpr double lanes = 8.0, product = 1.0 / 45e9, entry = 0.6e-9, front = 0.4e-6;
  const auto whole = [](double x) {
    return lanes * static_cast<double>(Index((x + lanes - 1) / lanes));
  };
  const double columns = whole(k), rows = whole(m);
  const double work = columns * (columns * columns / 3 + columns * rows + rows * rows);
  return product * work + entry * (m * m / 2 + k * (k / 2 + m)) + front;
}

/// The groups in their new order, children before parents in the elimination tree.
struct Tree {
  const GroupGraph& graph;
  std::vector<Index> group;        ///< of each position
  std::vector<Index> place;        ///< of each group its position
  std::vector<Index> parent;       ///< positions, −1 for a root
  std::vector<std::int64_t> start; ///< (positions + 1) of both triangles, by position
  std::vector<Index> neighbour;

  Index size() const { return static_cast<Index>(group.size()); }
  Index weight(Index p) const {
    return static_cast<Index>(graph.unknowns[at(group[at(p)])].size());
  }

  Tree(const GroupGraph& given, const std::vector<std::int64_t>& order) : graph(given) {
    group.assign(order.begin(), order.end());
    renumber();
    find_parents();
    postorder();
    renumber();
    find_parents();
  }

  /// Neighbours of each position among the positions before and behind it.
  void renumber() {
    const auto n = group.size();
    place.resize(n);
    for (std::size_t p = 0; p < n; ++p)
      place[at(group[p])] = static_cast<Index>(p);
    start.assign(n + 1, 0);
    const auto edges = [&](auto use) {
      for (std::size_t g = 0; g < n; ++g)
        for (std::int64_t e = graph.start[g]; e < graph.start[g + 1]; ++e)
          if (const auto other = at(graph.row[at(e)]); other != g) use(place[g], place[other]);
    };
    edges([&](Index a, Index b) { ++start[at(a) + 1], ++start[at(b) + 1]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    neighbour.resize(at(start.back()));
    std::vector<std::int64_t> next(start.begin(), start.end() - 1);
    edges([&](Index a, Index b) {
      neighbour[at(next[at(a)]++)] = b;
      neighbour[at(next[at(b)]++)] = a;
    });
  }

  template <class Use>
  void for_neighbours(Index p, Use use) const {
    for (std::int64_t e = start[at(p)]; e < start[at(p) + 1]; ++e)
      use(neighbour[at(e)]);
  }

  /// Liu (1986), ACM TOMS 12(2): ancestors with compressed paths.
  void find_parents() {
    parent.assign(group.size(), -1);
    std::vector<Index> ancestor(group.size(), -1);
    for (Index p = 0; p < size(); ++p)
      for_neighbours(p, [&](Index q) {
        while (q >= 0 && q < p) {
          const Index up = ancestor[at(q)];
          ancestor[at(q)] = p;
          if (up < 0) parent[at(q)] = p;
          q = up;
        }
      });
  }

  void postorder() {
    std::vector<Index> child(group.size(), -1), sibling(group.size(), -1), stack, done;
    for (Index p = size() - 1; p >= 0; --p) {
      if (parent[at(p)] < 0) continue;
      sibling[at(p)] = child[at(parent[at(p)])];
      child[at(parent[at(p)])] = p;
    }
    for (Index root = 0; root < size(); ++root) {
      if (parent[at(root)] >= 0) continue;
      stack.push_back(root);
      while (!stack.empty()) {
        const Index p = stack.back();
        if (const Index c = child[at(p)]; c >= 0) {
          child[at(p)] = sibling[at(c)];
          stack.push_back(c);
        } else {
          done.push_back(group[at(p)]);
          stack.pop_back();
        }
      }
    }
    group = std::move(done);
  }
};

/// Supernodes of positions, and their merging.
struct Supernodes {
  const Tree& tree;
  std::vector<Index> head, tail;         ///< first and last position of each
  std::vector<std::vector<Index>> below; ///< positions behind the tail, ascending
  std::vector<Index> owner;              ///< supernode of each position
  std::vector<double> columns, rows;     ///< unknowns of each, and below it
  std::vector<Index> parent, into;       ///< supernode above; the one that took it, or itself
  double flops = 0.0, nonzeros = 0.0;

  explicit Supernodes(const Tree& given) : tree(given), owner(at(given.size()), -1) {
    find();
    count();
    merge();
  }

  void find() {
    std::vector<Index> mark(at(tree.size()), -1), children(at(tree.size()), 0);
    for (Index p = 0; p < tree.size(); ++p)
      if (tree.parent[at(p)] >= 0) ++children[at(tree.parent[at(p)])];
    std::vector<std::vector<Index>> kids(at(tree.size())); // supernodes whose parent is p
    for (Index p = 0; p < tree.size(); ++p) {
      // Does p go on where the supernode of p − 1 ends?
      const bool chain = p > 0 && tree.parent[at(p - 1)] == p && children[at(p)] == 1;
      const Index before = chain ? owner[at(p - 1)] : -1;
      bool same = chain;
      if (chain) {
        for (const Index q : below[at(before)])
          mark[at(q)] = p;
        tree.for_neighbours(p, [&](Index q) { same = same && (q < p || mark[at(q)] == p); });
      }
      if (same) {
        owner[at(p)] = before;
        tail[at(before)] = p;
        std::vector<Index>& rows_below = below[at(before)];
        rows_below.erase(rows_below.begin()); // p itself
      } else {
        start_at(p, mark, kids[at(p)]);
      }
      const Index s = owner[at(p)];
      if (const Index up = tree.parent[at(p)]; up >= 0) {
        if (same) kids[at(p)].clear();
        kids[at(up)].push_back(s);
      }
    }
  }

  void start_at(Index p, std::vector<Index>& mark, const std::vector<Index>& kids) {
    std::vector<Index> found;
    const Index stamp = tree.size() + p; // differs from the marks of `find`
    const auto take = [&](Index q) {
      if (q <= p || mark[at(q)] == stamp) return;
      mark[at(q)] = stamp;
      found.push_back(q);
    };
    tree.for_neighbours(p, take);
    for (const Index kid : kids)
      std::for_each(below[at(kid)].begin(), below[at(kid)].end(), take);
    std::sort(found.begin(), found.end());
    owner[at(p)] = static_cast<Index>(head.size());
    head.push_back(p);
    tail.push_back(p);
    below.push_back(std::move(found));
  }

  Index size() const { return static_cast<Index>(head.size()); }

  void count() {
    for (Index s = 0; s < size(); ++s) {
      double m = 0.0, k = 0.0;
      for (const Index q : below[at(s)])
        m += tree.weight(q);
      for (Index p = head[at(s)]; p <= tail[at(s)]; ++p)
        k += tree.weight(p);
      columns.push_back(k);
      rows.push_back(m);
      parent.push_back(below[at(s)].empty() ? -1 : owner[at(below[at(s)].front())]);
      // Σ h and Σ h² over the columns' heights h = m + 1 … m + k
      nonzeros += k * m + k * (k + 1) / 2;
      const auto squares = [](double h) { return h * (h + 1) * (2 * h + 1) / 6; };
      flops += squares(m + k) - squares(m);
    }
  }

  /// Into its parent goes a child whose front costs more than the zeros of one front for both.
  void merge() {
    into.resize(head.size());
    std::iota(into.begin(), into.end(), 0);
    std::vector<std::vector<Index>> children(head.size());
    for (Index s = 0; s < size(); ++s) {
      std::vector<Index>& mine = children[at(s)];
      // Those with the most rows in common first.
      std::sort(mine.begin(), mine.end(), [&](Index a, Index b) {
        return std::make_pair(-rows[at(a)], a) < std::make_pair(-rows[at(b)], b);
      });
      std::vector<Index> left;
      for (const Index c : mine) {
        const double k = columns[at(c)] + columns[at(s)], m = rows[at(s)];
        if (cost(k, m) > cost(columns[at(c)], rows[at(c)]) + cost(columns[at(s)], m)) {
          left.push_back(c);
          continue;
        }
        into[at(c)] = s;
        columns[at(s)] = k;
        left.insert(left.end(), children[at(c)].begin(), children[at(c)].end());
      }
      mine = std::move(left);
      if (parent[at(s)] >= 0) children[at(parent[at(s)])].push_back(s);
    }
    for (Index s = size() - 1; s >= 0; --s)
      into[at(s)] = into[at(into[at(s)])];
  }
};

/// Unknowns and rows of the merged supernodes, in a postorder of their tree.
Symbolic expand(const Tree& tree, const Supernodes& nodes) {
  Symbolic result;
  result.flops = nodes.flops;
  result.nonzeros = nodes.nonzeros;
  std::vector<std::vector<Index>> members(at(nodes.size()));
  for (Index s = 0; s < nodes.size(); ++s)
    members[at(nodes.into[at(s)])].push_back(s);
  std::vector<Index> column(at(tree.size())); // first column of each position
  // A supernode stands after all that went into it or below it, for they come before its tail.
  for (Index s = 0; s < nodes.size(); ++s) {
    if (members[at(s)].empty()) continue;
    for (const Index part : members[at(s)])
      for (Index p = nodes.head[at(part)]; p <= nodes.tail[at(part)]; ++p) {
        column[at(p)] = static_cast<Index>(result.order.size());
        for (const std::int64_t u : tree.graph.unknowns[at(tree.group[at(p)])])
          result.order.push_back(static_cast<Index>(u));
      }
    result.first.push_back(static_cast<Index>(result.order.size()));
  }
  for (Index s = 0; s < nodes.size(); ++s) {
    if (members[at(s)].empty()) continue;
    const auto begin = static_cast<std::ptrdiff_t>(result.row.size());
    for (const Index q : nodes.below[at(s)])
      for (Index i = 0; i < tree.weight(q); ++i)
        result.row.push_back(column[at(q)] + i);
    std::sort(result.row.begin() + begin, result.row.end());
    result.start.push_back(static_cast<std::int64_t>(result.row.size()));
  }
  return result;
}

} // namespace

Symbolic factorise_symbolically(const GroupGraph& graph, const std::vector<std::int64_t>& order) {
  const Tree tree(graph, order);
  return expand(tree, Supernodes(tree));
}

} // namespace supple
