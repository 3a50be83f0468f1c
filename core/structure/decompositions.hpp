// Eigen's decompositions of dense matrices, compiled once: each costs the compiler some ten seconds wherever
// it is made from its template.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace Eigen {

extern template class HouseholderQR<MatrixXd>;
extern template class ColPivHouseholderQR<MatrixXd>;
extern template class JacobiSVD<MatrixXd>;
extern template class BDCSVD<MatrixXd>;
extern template class SelfAdjointEigenSolver<MatrixXd>;
extern template class SelfAdjointEigenSolver<Matrix3d>;

}  // namespace Eigen
