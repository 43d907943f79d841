/// Solves with the fronts of cholesky.cpp; private to the runtime.
#pragma once

#include <algorithm>
#include <vector>

#include "array.hpp"
#include "strips.hpp"
#include "supernodal_tree.hpp"

namespace supple {

/// Where the parts of a front lie in strips of S rows.
struct FrontLayout {
  const SupernodeTree* tree = nullptr;
  Index S = 1;

  const Supernode& node(Index s) const { return tree->node[static_cast<std::size_t>(s)]; }
  /// Strips of the diagonal block and of the rows below it.
  Index wide(const Supernode& node) const { return strips::whole(node.columns, S); }
  Index tall(const Supernode& node) const { return strips::whole(node.below, S); }
  const Index* places(const Supernode& node) const { return tree->place.data() + node.rows; }

  /// use(number) for each child of supernode s.
  template <class Use>
  void for_children(Index s, Use use) const {
    const auto at = static_cast<std::size_t>(s);
    for (Index c = tree->child_start[at]; c < tree->child_start[at + 1]; ++c)
      use(tree->child[static_cast<std::size_t>(c)]);
  }
};

/// x of L Lᵀ x = b, front by front: each has its part of x and of what it owes to the rows below.
template <class T>
class FrontVectors {
 public:
  /// Room for the fronts of `layout`, and for `threads` to use backward at once.
  void lay(const FrontLayout& layout, std::size_t threads) {
    layout_ = layout;
    start_.clear();
    std::int64_t end = 0;
    Index widest = 0;
    for (Index s = 0; s < layout.tree->size(); ++s) {
      const Supernode& f = layout.node(s);
      start_.push_back(end);
      end += (layout.wide(f) + layout.tall(f)) * static_cast<std::int64_t>(layout.S);
      widest = std::max(widest, layout.wide(f) * layout.S);
    }
    vector_.sized(end);
    work_.resize(threads);
    for (ArrayOf<T>& work : work_)
      work.sized(static_cast<std::int64_t>(widest) * layout.S);
  }

  /// One front of L y = scale · rhs; its children come before it.
  void forward(Index s, const T* factor, const double* rhs, double scale) {
    const Supernode& f = layout_.node(s);
    T* const x = part(s);
    gather_right_hand_side(s, rhs, scale);
    kernels_.forward(factor + f.panel, f.columns, layout_.tall(f), x, below(s));
  }

  /// One front of Lᵀ x = y, written to `result` times scale; its parent comes before it.
  void backward(Index s, const T* factor, double* result, double scale, int thread) {
    const Supernode& f = layout_.node(s);
    T* const x = part(s);
    gather_solution(s);
    kernels_.backward(factor + f.panel, f.columns, layout_.tall(f), x, below(s),
                      work_[static_cast<std::size_t>(thread)].get());
    for (Index j = 0; j < f.columns; ++j)
      result[unknown(f, j)] = static_cast<double>(x[j]) * scale;
  }

 private:
  T* part(Index s) const { return vector_.get() + start_[static_cast<std::size_t>(s)]; }
  T* below(Index s) const { return part(s) + layout_.wide(layout_.node(s)) * layout_.S; }
  Index unknown(const Supernode& f, Index j) const {
    return layout_.tree->order[static_cast<std::size_t>(f.first + j)];
  }

  void gather_right_hand_side(Index s, const double* rhs, double scale) {
    const Supernode& f = layout_.node(s);
    T *const x = part(s), *const under = below(s);
    std::fill(x, under + layout_.tall(f) * layout_.S, T(0));
    for (Index j = 0; j < f.columns; ++j)
      x[j] = static_cast<T>(rhs[unknown(f, j)] * scale);
    layout_.for_children(s, [&](Index child) {
      const Index* const place = layout_.places(layout_.node(child));
      const T* const from = below(child);
      for (Index i = 0; i < layout_.node(child).below; ++i)
        (place[i] < f.columns ? x[place[i]] : under[place[i] - f.columns]) += from[i];
    });
  }

  /// The entries of x that the rows below stand for, from the parent, which has them all.
  void gather_solution(Index s) {
    const Supernode& f = layout_.node(s);
    if (f.parent < 0) return;
    const Supernode& parent = layout_.node(f.parent);
    const T* const from = part(f.parent);
    T* const under = below(s);
    const Index shift = layout_.wide(parent) * layout_.S - parent.columns;
    const Index* const place = layout_.places(f);
    for (Index i = 0; i < f.below; ++i)
      under[i] = from[place[i] < parent.columns ? place[i] : place[i] + shift];
  }

  const strips::Kernels<T>& kernels_ = strips::kernels<T>();
  FrontLayout layout_;
  ArrayOf<T> vector_;
  std::vector<std::int64_t> start_; // of each supernode in vector_
  std::vector<ArrayOf<T>> work_;    // of each thread
};

} // namespace supple
