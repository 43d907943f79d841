/// The symbolic part of a supernodal multifrontal factorisation; private to the runtime.
///
/// A supernode is a run of columns of L with the same rows below them. Its front holds those
/// columns (the panel) and the update that they make to the rows below, which its parent takes
/// over: Duff and Reid (1983), ACM TOMS 9(3).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "symbolic.hpp"

namespace supple {

/// Where one stored entry of A goes: its place in `values` and in the panels of its supernode.
struct Slot {
  std::uint32_t source, target;
};

struct Supernode {
  Index first = 0;   ///< column, in the order of the factorisation
  Index columns = 0; ///< k
  Index below = 0;   ///< m rows below the diagonal block
  Index parent = -1;
  std::int64_t rows = 0;   ///< offset in SupernodeTree::row and ::place of the m rows
  std::int64_t panel = 0;  ///< offset in the factor: (k + m, k) L and, for LU, (m, k) Uᵀ behind it
  std::int64_t update = 0; ///< offset in the work space of the update (m, m)
  std::size_t slots = 0;   ///< offset in SupernodeTree::slot; the next supernode's ends them

  Index height() const { return columns + below; }
};

/// A run [begin, end) of supernodes.
struct Range {
  Index begin, end;
};

struct SupernodeTree {
  std::vector<Index> order;         ///< (n) unknown that is column j
  std::vector<Supernode> node;      ///< children before parents; one more at the end
  std::vector<Index> row;           ///< column numbers of the rows below, ascending
  std::vector<Index> place;         ///< the same rows as row numbers of the parent's front
  std::vector<Index> child_start;   ///< (nodes + 1)
  std::vector<Index> child;         ///< of each supernode, ascending
  std::vector<Slot> slot;           ///< entries of A by supernode
  std::vector<Range> branch;        ///< subtrees that share nothing, to be factorised at once
  std::vector<Index> trunk;         ///< the supernodes above them, ascending
  std::int64_t panels = 0;          ///< entries of all panels
  std::int64_t updates = 0;         ///< entries of the work space
  std::int64_t tallest_product = 0; ///< most entries of an (m, k) block, or of a diagonal's work

  Index size() const { return static_cast<Index>(node.size()) - 1; }
};

/// A tree, and what its ordering costs.
struct TreeReport {
  SupernodeTree tree;
  std::shared_ptr<const Analysis> analysis;
};

/// Analyse a pattern; of a full one that of A + Aᵀ, with room for U.
/// @param branches how many independent subtrees to look for; 1 for none.
/// @param lanes rows of a strip where panels and updates are laid out in strips, 0 for columns.
/// @throws NumericalError out of memory, or a front of more than 2³² entries.
TreeReport make_tree(const CscPattern& pattern, int branches, Index lanes = 0);

/// The same, or the one of a factor that lives and has the same pattern: a body's direct and
/// inverse forms are analysed once.
std::shared_ptr<const TreeReport> shared_tree(const CscPattern& pattern, int branches,
                                              Index lanes = 0);

} // namespace supple
