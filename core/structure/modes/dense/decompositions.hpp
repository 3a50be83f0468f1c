// Eigen's decompositions of dense matrices, compiled once, because the compiler needs about ten seconds for
// each instantiation.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "core/scene/products.hpp"

namespace Eigen {

extern template class HouseholderQR<MatrixXd>;
extern template class ColPivHouseholderQR<MatrixXd>;
extern template class JacobiSVD<MatrixXd>;
extern template class BDCSVD<MatrixXd>;
extern template class RealSchur<MatrixXd>;
extern template class EigenSolver<MatrixXd>;
extern template EigenSolver<MatrixXd>& EigenSolver<MatrixXd>::compute(const EigenBase<MatrixXd>&, bool);
extern template class SelfAdjointEigenSolver<MatrixXd>;
extern template class SelfAdjointEigenSolver<Matrix3d>;
extern template SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);
extern template SelfAdjointEigenSolver<Matrix3d>& SelfAdjointEigenSolver<Matrix3d>::compute(
    const EigenBase<Matrix3d>&, int);
extern template void MatrixBase<Block<MatrixXd>>::applyHouseholderOnTheLeft(
    const Block<const MatrixXd, Dynamic, 1>&, const double&, double*);
extern template void MatrixBase<Block<MatrixXd>>::applyHouseholderOnTheRight(
    const Block<const MatrixXd, Dynamic, 1>&, const double&, double*);

namespace internal {

extern template void apply_block_householder_on_the_left(Block<MatrixXd>&, const Block<MatrixXd>&,
                                                         const VectorBlock<const VectorXd>&, bool);

}  // namespace internal
}  // namespace Eigen
