#include "tools/verification/reference/rotation_factor.hpp"

#include <klu.h>

#include <algorithm>
#include <limits>

namespace freeflex {

/// Owns the objects of KLU.
struct RotationFactor::Klu {
  klu_common common{};
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;

  Klu() { klu_defaults(&common); }
  Klu(const Klu&) = delete;
  Klu& operator=(const Klu&) = delete;
  ~Klu() {
    klu_free_numeric(&numeric, &common);
    klu_free_symbolic(&symbolic, &common);
  }
};

RotationFactor::RotationFactor() = default;

RotationFactor::RotationFactor(std::vector<std::pair<int, int>> pairs, const Eigen::MatrixXd& idle)
    : size_(static_cast<int>(idle.rows() + idle.cols())), num_rotations_(static_cast<int>(idle.rows())) {
  for (int k = num_rotations_; k < size_; ++k)
    for (int i = 0; i < num_rotations_; ++i) {
      pairs.emplace_back(i, k);
      pairs.emplace_back(k, i);
    }
  const auto by_column = [](const auto& pair) { return std::pair(pair.second, pair.first); };
  std::ranges::sort(pairs, {}, by_column);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  column_starts_.assign(static_cast<std::size_t>(size_) + 1, 0);
  for (const auto& [row, column] : pairs) {
    ++column_starts_[static_cast<std::size_t>(column) + 1];
    rows_.push_back(row);
    const bool is_border = row >= num_rotations_ || column >= num_rotations_;
    values_.push_back(is_border ? idle(std::min(row, column), std::max(row, column) - num_rotations_) : 0.0);
  }
  for (std::size_t c = 1; c < column_starts_.size(); ++c) column_starts_[c] += column_starts_[c - 1];
}

RotationFactor::RotationFactor(const RotationFactor& other)
    : size_(other.size_),
      num_rotations_(other.num_rotations_),
      column_starts_(other.column_starts_),
      rows_(other.rows_),
      values_(other.values_) {
  if (other.klu_) factor();
}

RotationFactor& RotationFactor::operator=(const RotationFactor& other) {
  if (this != &other) *this = RotationFactor(other);
  return *this;
}

RotationFactor::RotationFactor(RotationFactor&&) noexcept = default;
RotationFactor& RotationFactor::operator=(RotationFactor&&) noexcept = default;
RotationFactor::~RotationFactor() = default;

void RotationFactor::compute(const Eigen::MatrixXd& K, const Eigen::VectorXd& scale) {
  for (int c = 0; c < num_rotations_; ++c)
    for (auto k = static_cast<std::size_t>(column_starts_[static_cast<std::size_t>(c)]);
         k < static_cast<std::size_t>(column_starts_[static_cast<std::size_t>(c) + 1]); ++k)
      if (rows_[k] < num_rotations_) values_[k] = K(rows_[k], c) / (scale[rows_[k]] * scale[c]);
  factor();
}

void RotationFactor::factor() {
  if (!klu_) {
    klu_ = std::make_unique<Klu>();
    klu_->symbolic = klu_analyze(size_, column_starts_.data(), rows_.data(), &klu_->common);
  }
  klu_free_numeric(&klu_->numeric, &klu_->common);
  klu_->numeric =
      klu_factor(column_starts_.data(), rows_.data(), values_.data(), klu_->symbolic, &klu_->common);
}

void RotationFactor::solve(std::span<double> right) const {
  if (klu_->numeric == nullptr ||
      klu_solve(klu_->symbolic, klu_->numeric, size_, 1, right.data(), &klu_->common) == 0)
    std::ranges::fill(right, std::numeric_limits<double>::quiet_NaN());
}

}  // namespace freeflex
