#include "rig_tree.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "lane_bits.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;

template <class V>
void clamp_to_unit(V& t) {
  t = t > 0.0 ? t : V{};
  t = t < 1.0 ? t : V{} + 1.0;
}

double inverse_of(double value) {
  return value > 0.0 ? 1.0 / value : 0.0;
}

} // namespace

SkinTree::SkinTree(const Points& points, const Triangles& triangles)
    : triangles_(triangles), order_(static_cast<std::size_t>(triangles.rows())) {
  std::iota(order_.begin(), order_.end(), 0);
  build(points, 0, static_cast<int>(order_.size()));
  widen(0);
  refit(points);
}

/// Halves at the median of the longest side's centroids, in multiples of a leaf.
void SkinTree::build(const Points& points, int begin, int end) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  if (end - begin <= kLanes) {
    nodes_[self].leaf = static_cast<int>(leaves_.size());
    Leaf leaf{};
    for (int k = 0; k < kLanes; ++k) // the last triangle fills the lanes that are left
      leaf.triangle[k] = order_[static_cast<std::size_t>(std::min(begin + k, end - 1))];
    leaves_.push_back(leaf);
    return;
  }
  const auto centre = [&](int t, int axis) {
    return points(triangles_(t, 0), axis) + points(triangles_(t, 1), axis) +
           points(triangles_(t, 2), axis);
  };
  int longest = 0;
  double extent = -1.0;
  for (int axis = 0; axis < 3; ++axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (int k = begin; k < end; ++k) {
      low = std::min(low, centre(order_[static_cast<std::size_t>(k)], axis));
      high = std::max(high, centre(order_[static_cast<std::size_t>(k)], axis));
    }
    if (high - low > extent) {
      extent = high - low;
      longest = axis;
    }
  }
  const int middle = begin + ((end - begin + 2 * kLanes - 1) / (2 * kLanes)) * kLanes;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](int s, int t) {
                     return std::pair{centre(s, longest), s} < std::pair{centre(t, longest), t};
                   });
  build(points, begin, middle);
  nodes_[self].right = static_cast<int>(nodes_.size());
  build(points, middle, end);
}

/// The wide node of a node and the two levels below it.
int SkinTree::widen(int node) {
  std::vector<int> below{node};
  for (int level = 0; level < 3; ++level) {
    std::vector<int> next;
    for (const int n : below) {
      next.push_back(nodes_[static_cast<std::size_t>(n)].leaf < 0 ? n + 1 : n);
      if (nodes_[static_cast<std::size_t>(n)].leaf < 0)
        next.push_back(nodes_[static_cast<std::size_t>(n)].right);
    }
    below.swap(next);
  }
  const std::size_t self = wide_.size();
  wide_.emplace_back();
  for (std::size_t k = 0; k < kLanes; ++k) {
    const int n = k < below.size() ? below[k] : -1;
    const int leaf = n < 0 ? -1 : nodes_[static_cast<std::size_t>(n)].leaf;
    const int child = n < 0 || leaf >= 0 ? ~leaf : widen(n);
    wide_[self].node[k] = n;
    wide_[self].child[k] = child;
  }
  return static_cast<int>(self);
}

void SkinTree::fill(Wide& wide) const {
  const double far = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kLanes; ++k)
    for (int d = 0; d < 3; ++d) {
      const int n = wide.node[k];
      wide.low[d][k] = n < 0 ? far : nodes_[static_cast<std::size_t>(n)].box.low[d];
      wide.high[d][k] = n < 0 ? -far : nodes_[static_cast<std::size_t>(n)].box.high[d];
    }
}

void SkinTree::fill(const Points& points, Leaf& leaf) const {
  for (int k = 0; k < kLanes; ++k) {
    const auto corner = triangles_.row(leaf.triangle[k]);
    const Vec3 a = points.row(corner[0]).transpose();
    const Vec3 ab = Vec3(points.row(corner[1]).transpose()) - a;
    const Vec3 ac = Vec3(points.row(corner[2]).transpose()) - a;
    for (int d = 0; d < 3; ++d) {
      leaf.a[d][k] = a[d];
      leaf.ab[d][k] = ab[d];
      leaf.ac[d][k] = ac[d];
    }
    const double bb = ab.squaredNorm(), bc = ab.dot(ac), cc = ac.squaredNorm();
    const double area = bb * cc - bc * bc;
    leaf.bb[k] = bb;
    leaf.bc[k] = bc;
    leaf.cc[k] = cc;
    leaf.inverse[k] = area > 1e-13 * bb * cc ? 1.0 / area : 0.0;
    leaf.of_bb[k] = inverse_of(bb);
    leaf.of_cc[k] = inverse_of(cc);
    leaf.of_opposite[k] = inverse_of((ac - ab).squaredNorm());
  }
}

/// A leaf and the box around its triangles.
void SkinTree::refit_leaf(const Points& points, Node& node) {
  Leaf& leaf = leaves_[static_cast<std::size_t>(node.leaf)];
  Box& box = node.box;
  fill(points, leaf);
  for (int d = 0; d < 3; ++d) {
    box.low[d] = std::numeric_limits<double>::infinity();
    box.high[d] = -box.low[d];
    for (int k = 0; k < kLanes; ++k)
      for (int c = 0; c < 3; ++c) {
        const double x = points(triangles_(leaf.triangle[k], c), d);
        box.low[d] = std::min(box.low[d], x);
        box.high[d] = std::max(box.high[d], x);
      }
  }
}

void SkinTree::refit(const Points& points) {
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    if (nodes_[n].leaf >= 0) refit_leaf(points, nodes_[n]);
  for (std::size_t n = nodes_.size(); n-- > 0;) { // children stand behind their parents
    if (nodes_[n].leaf >= 0) continue;
    Box& box = nodes_[n].box;
    const Box& one = nodes_[n + 1].box;
    const Box& other = nodes_[static_cast<std::size_t>(nodes_[n].right)].box;
    for (int d = 0; d < 3; ++d) {
      box.low[d] = std::min(one.low[d], other.low[d]);
      box.high[d] = std::max(one.high[d], other.high[d]);
    }
  }
  for (Wide& wide : wide_)
    fill(wide);
}

void SkinTree::Wide::measure(const Vec3& q, Lanes& squared) const {
  squared = Lanes{};
  for (int d = 0; d < 3; ++d) {
    const Lanes below = low[d] - q[d], above = q[d] - high[d];
    Lanes outside = below > above ? below : above;
    outside = outside > 0.0 ? outside : Lanes{};
    squared += outside * outside;
  }
}

Landing SkinTree::closest(const Vec3& q, double reach, int hint) const {
  struct Entry {
    double squared;
    int child;
  };
  Landing best;
  best.squared = reach * reach;
  if (hint >= 0) visit(q, hint, best);
  std::array<Entry, 12 * kLanes> stack; // of 2³¹ triangles at most, ten wide nodes deep
  std::size_t top = 0;
  stack[top++] = {0.0, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.squared >= best.squared) continue;
    if (entry.child < 0) {
      if (~entry.child != hint) visit(q, ~entry.child, best);
      continue;
    }
    const Wide& wide = wide_[static_cast<std::size_t>(entry.child)];
    Lanes squared;
    wide.measure(q, squared);
    const std::size_t from = top;
    each_bit(bits_of(squared < best.squared), [&](std::size_t k) {
      std::size_t at = top++; // the nearest on top
      for (; at > from && stack[at - 1].squared < squared[k]; --at)
        stack[at] = stack[at - 1];
      stack[at] = {squared[k], wide.child[k]};
    });
  }
  return best;
}

/// Of each triangle the best of the point inside and those on its edges, by the quadratic
/// |v ab + w ac|² − 2 (v ab + w ac)·aq, which is their distance² but for |aq|².
/// Source: Ericson (2005), Real-Time Collision Detection, §3.4, §5.1.5.
void SkinTree::visit(const Vec3& q, int number, Landing& best) const {
  const Leaf& leaf = leaves_[static_cast<std::size_t>(number)];
  Lanes aq[3], b{}, c{};
  for (int d = 0; d < 3; ++d) {
    aq[d] = q[d] - leaf.a[d];
    b += aq[d] * leaf.ab[d];
    c += aq[d] * leaf.ac[d];
  }
  Lanes v = (leaf.cc * b - leaf.bc * c) * leaf.inverse;
  Lanes w = (leaf.bb * c - leaf.bc * b) * leaf.inverse;
  const auto inside = (v > 0.0) & (w > 0.0) & (v + w < 1.0) & (leaf.inverse > 0.0);
  Lanes t = b * leaf.of_bb, s = c * leaf.of_cc, u = (c - b - leaf.bc + leaf.bb) * leaf.of_opposite;
  clamp_to_unit(t);
  clamp_to_unit(s);
  clamp_to_unit(u);
  const Lanes rest = 1.0 - u;
  const Lanes of_t = t * (t * leaf.bb - 2.0 * b), of_s = s * (s * leaf.cc - 2.0 * c);
  const Lanes of_u =
      rest * (rest * leaf.bb + 2.0 * u * leaf.bc - 2.0 * b) + u * (u * leaf.cc - 2.0 * c);
  const auto along_b = (of_t <= of_s) & (of_t <= of_u);
  const auto along_c = (of_s < of_t) & (of_s <= of_u);
  v = inside ? v : along_b ? t : along_c ? Lanes{} : rest;
  w = inside ? w : along_b ? Lanes{} : along_c ? s : u;
  Lanes squared{};
  for (int d = 0; d < 3; ++d) {
    const Lanes gap = aq[d] - v * leaf.ab[d] - w * leaf.ac[d];
    squared += gap * gap;
  }
  each_bit(bits_of(squared <= best.squared), [&](std::size_t k) {
    if (!(squared[k] < best.squared || (squared[k] == best.squared && best.triangle < 0))) return;
    best.triangle = leaf.triangle[k];
    best.squared = squared[k];
    best.leaf = number;
    const bool opposite = !inside[k] && !along_b[k] && !along_c[k];
    best.barycentric = Vec3(opposite ? 0.0 : 1.0 - v[k] - w[k], v[k], w[k]);
  });
}

} // namespace supple
