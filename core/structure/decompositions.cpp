#include "core/structure/decompositions.hpp"

namespace Eigen {

template class HouseholderQR<MatrixXd>;
template class ColPivHouseholderQR<MatrixXd>;
template class JacobiSVD<MatrixXd>;
template class BDCSVD<MatrixXd>;
template class SelfAdjointEigenSolver<MatrixXd>;
template class SelfAdjointEigenSolver<Matrix3d>;

}  // namespace Eigen
