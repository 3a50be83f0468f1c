#include "core/structure/modes/dense/decompositions.hpp"

namespace Eigen {

template class HouseholderQR<MatrixXd>;
template class ColPivHouseholderQR<MatrixXd>;
template class JacobiSVD<MatrixXd>;
template class BDCSVD<MatrixXd>;
template class RealSchur<MatrixXd>;
template class EigenSolver<MatrixXd>;
template EigenSolver<MatrixXd>& EigenSolver<MatrixXd>::compute(const EigenBase<MatrixXd>&, bool);
template class SelfAdjointEigenSolver<MatrixXd>;
template class SelfAdjointEigenSolver<Matrix3d>;
template SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);
template SelfAdjointEigenSolver<Matrix3d>& SelfAdjointEigenSolver<Matrix3d>::compute(
    const EigenBase<Matrix3d>&, int);
template void MatrixBase<Block<MatrixXd>>::applyHouseholderOnTheLeft(const Block<const MatrixXd, Dynamic, 1>&,
                                                                     const double&, double*);
template void MatrixBase<Block<MatrixXd>>::applyHouseholderOnTheRight(
    const Block<const MatrixXd, Dynamic, 1>&, const double&, double*);

namespace internal {

template void apply_block_householder_on_the_left(Block<MatrixXd>&, const Block<MatrixXd>&,
                                                  const VectorBlock<const VectorXd>&, bool);

}  // namespace internal
}  // namespace Eigen
