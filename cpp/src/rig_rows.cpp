#include "rig_rows.hpp"

#include <cmath>

namespace supple {

using Index = Eigen::Index;

double energy_of(const std::vector<Row>& rows, const Points& vertices) {
  double sum = 0.0;
  for (const Row& row : rows)
    sum += row.weight * loss_of(row.residual(vertices), row.loss);
  return sum;
}

void NormalSum::add(const std::vector<Row>& rows, const SkinState& state, Normal& normal,
                    Unknowns of) {
  const int unknowns = of == Unknowns::All ? state.rig.unknowns() : 9 * state.rig.bones();
  const int count = static_cast<int>(rows.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (int s = 0; s < kSums; ++s) {
    Part& part = parts_[static_cast<std::size_t>(s)];
    part.matrix.setZero(unknowns, unknowns);
    part.gradient.setZero(unknowns);
    part.place.assign(static_cast<std::size_t>(unknowns), -1);
    for (int begin = s * kChunk; begin < count; begin += kSums * kChunk)
      add_chunk(rows.data() + begin, rows.data() + std::min(begin + kChunk, count), state, of,
                part);
  }
#pragma omp parallel for schedule(static)
  for (int column = 0; column < unknowns; ++column)
    for (const Part& part : parts_) {
      const int below = unknowns - column;
      normal.matrix.col(column).segment(column, below) += part.matrix.col(column).tail(below);
      normal.gradient[column] += part.gradient[column];
    }
}

void NormalSum::add_chunk(const Row* first, const Row* last, const SkinState& state, Unknowns of,
                          Part& part) {
  const Rig& rig = state.rig;
  const auto mark = [&](int column) { part.place[static_cast<std::size_t>(column)] = 0; };
  for (const Row* row = first; row != last; ++row)
    for (std::size_t c = 0; c < 3; ++c) {
      if (row->share[c] == 0.0) continue;
      for (const BoneWeight& at : rig.bones_at(row->vertex[c]))
        mark(9 * at.bone);
      if (of == Unknowns::Bones) continue;
      for (const ShapeOffset& at : rig.shapes_at(row->vertex[c]))
        mark(9 * rig.bones() + at.shape);
    }
  part.columns.clear();
  const int unknowns = static_cast<int>(part.place.size());
  for (int column = 0; column < unknowns; ++column) {
    const bool of_bone = column < 9 * rig.bones();
    if (part.place[static_cast<std::size_t>(of_bone ? column - column % 9 : column)] < 0) continue;
    part.place[static_cast<std::size_t>(column)] = static_cast<int>(part.columns.size());
    part.columns.push_back(column);
  }
  const Index width = static_cast<Index>(part.columns.size()), height = last - first;
  part.panel.setZero(width, height);
  part.residual.resize(height);
  for (Index i = 0; i < height; ++i) {
    const Row& row = first[i];
    const double residual = row.residual(state.points);
    const double root = std::sqrt(row.weight * loss_weight(residual, row.loss));
    part.residual[i] = root * residual;
    double* const column = part.panel.col(i).data();
    state.add_point(row.vertex, row.share, root * row.direction, of,
                    [&](int unknown, double value) {
                      column[part.place[static_cast<std::size_t>(unknown)]] += value;
                    });
  }
  part.product.setZero(width, width);
  part.product.selfadjointView<Eigen::Lower>().rankUpdate(part.panel);
  part.step.noalias() = part.panel * part.residual;
  for (Index b = 0; b < width; ++b) {
    const int column = part.columns[static_cast<std::size_t>(b)];
    part.gradient[column] += part.step[b];
    for (Index a = b; a < width; ++a)
      part.matrix(part.columns[static_cast<std::size_t>(a)], column) += part.product(a, b);
  }
  for (const int column : part.columns)
    part.place[static_cast<std::size_t>(column)] = -1;
}

} // namespace supple
