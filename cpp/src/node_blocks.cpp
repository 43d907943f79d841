#include "node_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "supple/error.hpp"

namespace supple {

NodeBlocks::NodeBlocks(const CscPattern& pattern, std::vector<Index> dof) {
  require_size("dof", static_cast<long long>(dof.size()), pattern.size, "one entry an unknown");
  if (!pattern.lower)
    throw ShapeError("pattern must hold the lower triangle alone, got the full matrix; reduce with "
                     "Storage::Lower");
  for (const Index d : dof) {
    if (node_.empty() || node_.back() != d / 3) node_.push_back(d / 3);
    place_.push_back(static_cast<Index>(3 * (node_.size() - 1)) + d % 3);
  }
  free_.assign(3 * node_.size(), 0);
  for (const Index p : place_)
    free_[static_cast<std::size_t>(p)] = 1;
  find_blocks(pattern);
  find_twins();
}

/// Columns ascend in each row: first the blocks of the rows before, then those behind.
void NodeBlocks::find_blocks(const CscPattern& pattern) {
  std::vector<std::pair<Index, Index>> upper; // (row, column) with column ≥ row
  std::vector<std::size_t> first(node_.size() + 1, 0);
  std::vector<Index> seen(node_.size(), -1), count(node_.size() + 1, 0);
  for (std::int64_t j = 0; j < pattern.size;) {
    const Index row = place_[static_cast<std::size_t>(j)] / 3;
    const std::size_t begin = upper.size();
    for (; j < pattern.size && place_[static_cast<std::size_t>(j)] / 3 == row; ++j)
      for (std::int64_t k = pattern.start[static_cast<std::size_t>(j)];
           k < pattern.start[static_cast<std::size_t>(j) + 1]; ++k) {
        const auto unknown = static_cast<std::size_t>(pattern.row[static_cast<std::size_t>(k)]);
        const Index column = place_[unknown] / 3;
        if (std::exchange(seen[static_cast<std::size_t>(column)], row) != row)
          upper.emplace_back(row, column);
      }
    std::sort(upper.begin() + static_cast<std::ptrdiff_t>(begin), upper.end());
  }
  matrix_.rows = matrix_.columns = nodes();
  matrix_.start.assign(node_.size() + 1, 0);
  for (const auto& [row, column] : upper) {
    ++matrix_.start[static_cast<std::size_t>(row) + 1];
    if (column != row) ++matrix_.start[static_cast<std::size_t>(column) + 1];
  }
  for (std::size_t i = 0; i < node_.size(); ++i)
    matrix_.start[i + 1] += matrix_.start[i];
  matrix_.column.resize(static_cast<std::size_t>(matrix_.start.back()));
  std::vector<std::int64_t> next(matrix_.start.begin(), matrix_.start.end() - 1);
  const auto put = [&](Index row, Index column) {
    matrix_.column[static_cast<std::size_t>(next[static_cast<std::size_t>(row)]++)] = column;
  };
  for (const auto& [row, column] : upper)
    if (column != row) put(column, row);
  for (const auto& [row, column] : upper)
    put(row, column);
  matrix_.allocate();
}

void NodeBlocks::find_twins() {
  twin_.assign(matrix_.column.size(), -1);
  std::vector<std::int64_t> next(node_.size()); // the block of each row to be met next
  for (Index i = 0; i < matrix_.rows; ++i)
    next[static_cast<std::size_t>(i)] = matrix_.find(i, i) + 1;
  for (Index i = 0; i < matrix_.rows; ++i)
    for (std::int64_t k = matrix_.start[static_cast<std::size_t>(i)];
         matrix_.column[static_cast<std::size_t>(k)] < i; ++k)
      twin_[static_cast<std::size_t>(k)] =
          next[static_cast<std::size_t>(matrix_.column[static_cast<std::size_t>(k)])]++;
}

void NodeBlocks::fill(const CscPattern& pattern, const ConstVector& values) {
  require_size("values", values.size(), pattern.nonzeros(), "one an entry of the pattern");
  double mean = 0.0;
  for (std::int64_t j = 0; j < pattern.size; ++j)
    mean += std::abs(values[pattern.start[static_cast<std::size_t>(j)]]);
  mean /= static_cast<double>(std::max<std::int64_t>(pattern.size, 1));
  std::vector<std::int64_t> first(node_.size() + 1, pattern.size); // unknown of each node
  for (std::int64_t j = pattern.size; j-- > 0;)
    first[static_cast<std::size_t>(place_[static_cast<std::size_t>(j)] / 3)] = j;
#pragma omp parallel for schedule(static)
  for (Index i = 0; i < matrix_.rows; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const std::int64_t diagonal = matrix_.find(i, i);
    std::fill(matrix_.block(diagonal), matrix_.block(matrix_.start[row + 1]), 0.0);
    for (int c = 0; c < 3; ++c)
      if (!free_[3 * row + static_cast<std::size_t>(c)]) matrix_.block(diagonal)[4 * c] = mean;
    for (std::int64_t j = first[row]; j < first[row + 1]; ++j) {
      const int c = place_[static_cast<std::size_t>(j)] % 3;
      std::int64_t at = diagonal;
      for (std::int64_t k = pattern.start[static_cast<std::size_t>(j)];
           k < pattern.start[static_cast<std::size_t>(j) + 1]; ++k) {
        const auto unknown = static_cast<std::size_t>(pattern.row[static_cast<std::size_t>(k)]);
        const Index place = place_[unknown];
        while (matrix_.column[static_cast<std::size_t>(at)] != place / 3)
          ++at;
        matrix_.block(at)[3 * (place % 3) + c] = values[k];
        if (at == diagonal) matrix_.block(at)[3 * c + place % 3] = values[k];
      }
    }
  }
#pragma omp parallel for schedule(static)
  for (Index i = 0; i < matrix_.rows; ++i)
    for (std::int64_t k = matrix_.start[static_cast<std::size_t>(i)];
         matrix_.column[static_cast<std::size_t>(k)] < i; ++k) {
      const double* mirrored = matrix_.block(twin_[static_cast<std::size_t>(k)]);
      double* block = matrix_.block(k);
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
          block[3 * c + r] = mirrored[3 * r + c];
    }
}

} // namespace supple
