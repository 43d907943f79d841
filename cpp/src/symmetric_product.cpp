#include "symmetric_product.hpp"

#include <algorithm>

#include "supple/error.hpp"

namespace supple {
namespace {

std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

/// Columns after `first`, itself too, that have the rows of `first` but for those above themselves.
Index same_rows(const CscPattern& p, Index first) {
  const auto begin = [&](Index c) { return p.row.begin() + p.start[at(c)]; };
  const auto end = [&](Index c) { return p.row.begin() + p.start[at(c) + 1]; };
  Index count = 1;
  while (count < 3 && first + count < p.size &&
         std::equal(begin(first) + std::min<std::ptrdiff_t>(count, end(first) - begin(first)),
                    end(first), begin(first + count), end(first + count)))
    ++count;
  return count;
}

/// The part of y += A x of the columns of one node; `x` and `y` are at their first row.
template <int m>
void add(const double* const* value, const Index* row, Index below, Index first, const double* x,
         double* y) {
  double sum[m], own[m];
  for (int j = 0; j < m; ++j) {
    own[j] = x[first + j];
    sum[j] = value[j][0] * own[j];
  }
  for (int j = 0; j < m; ++j) {
    for (int i = j + 1; i < m; ++i) {
      sum[i] += value[j][i - j] * own[j];
      sum[j] += value[j][i - j] * own[i];
    }
  }
  const double* column[m];
  for (int j = 0; j < m; ++j)
    column[j] = value[j] + (m - j);
  for (Index k = 0; k < below; ++k) {
    const Index r = row[k];
    const double other = x[r];
    double total = 0.0;
    for (int j = 0; j < m; ++j) {
      total += column[j][k] * own[j];
      sum[j] += column[j][k] * other;
    }
    y[r] += total;
  }
  for (int j = 0; j < m; ++j)
    y[first + j] += sum[j];
}

} // namespace

SymmetricProduct::SymmetricProduct(const CscPattern& p) {
  if (!p.lower) throw ShapeError("pattern must store the lower triangle, got the full matrix");
  for (Index first = 0; first < p.size;) {
    const Index count = same_rows(p, first);
    const auto begin = p.start[at(first)] + count, end = p.start[at(first) + 1];
    Columns c{first, count, static_cast<Index>(end - begin), row_.size(), {0, 0, 0}};
    for (Index j = 0; j < count; ++j)
      c.at[j] = p.start[at(first + j)];
    for (auto k = begin; k < end; ++k)
      row_.push_back(static_cast<Index>(p.row[static_cast<std::size_t>(k)]));
    columns_.push_back(c);
    first += count;
  }
}

void SymmetricProduct::apply(const Vector& values, const Vector& x, Vector& y) const {
  y.setZero(x.size());
  for (const Columns& c : columns_) {
    const double* value[3] = {values.data() + c.at[0], values.data() + c.at[1],
                              values.data() + c.at[2]};
    const Index* row = row_.data() + c.rows;
    if (c.count == 3) {
      add<3>(value, row, c.below, c.first, x.data(), y.data());
    } else if (c.count == 2) {
      add<2>(value, row, c.below, c.first, x.data(), y.data());
    } else {
      add<1>(value, row, c.below, c.first, x.data(), y.data());
    }
  }
}

} // namespace supple
