// Products of tall matrices with a few vectors.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace freeflex {

/// Calls work(k) for k from 0 to count - 1, which do not depend on one another (SetupProgress::share).
using ShareWork = std::function<void(int count, const std::function<void(int)>& work)>;
/// Calls them through `share`, or one after another if it is empty.
void run_shared(const ShareWork& share, int count, const std::function<void(int)>& work);

/// Largest number of vectors of the functions below.
inline constexpr Eigen::Index kMostNarrow = 8;

/// Returns x^T y of the first `count` columns of x. The rows are divided into parts that `share` may share
/// out; the bits do not depend on it.
Eigen::MatrixXd narrow_products(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& y,
                                const ShareWork& share);
/// Subtracts the first `count` columns of x times h from y.
void subtract_narrow(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& h,
                     Eigen::MatrixXd& y, const ShareWork& share);

}  // namespace freeflex
