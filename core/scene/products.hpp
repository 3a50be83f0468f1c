// Eigen's products of dense matrices are compiled once here, because otherwise every file that multiplies two
// matrices would instantiate the templates again. The list below is for registers of two doubles, because for
// wider registers Eigen uses other kernels.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace Eigen::internal {

using ReadsColumns = const_blas_data_mapper<double, Index, ColMajor>;
using ReadsRows = const_blas_data_mapper<double, Index, RowMajor>;

extern template struct gebp_kernel<double, double, Index, blas_data_mapper<double, Index, ColMajor>, 4, 4>;
extern template struct gemm_pack_rhs<double, Index, ReadsColumns, 4, ColMajor>;
extern template struct gemm_pack_rhs<double, Index, ReadsRows, 4, RowMajor>;
extern template struct general_matrix_vector_product<Index, double, ReadsColumns, ColMajor, false, double,
                                                     ReadsColumns, false>;
extern template struct general_matrix_vector_product<Index, double, ReadsColumns, ColMajor, false, double,
                                                     ReadsRows, false>;
extern template struct general_matrix_vector_product<Index, double, ReadsRows, RowMajor, false, double,
                                                     ReadsColumns, false>;
extern template struct general_matrix_vector_product<Index, double, ReadsRows, RowMajor, false, double,
                                                     ReadsRows, false, BuiltIn>;
extern template void evaluateProductBlockingSizesHeuristic<double, double, 1, Index>(Index&, Index&, Index&,
                                                                                     Index);
extern template void evaluateProductBlockingSizesHeuristic<double, double, 4, Index>(Index&, Index&, Index&,
                                                                                     Index);
extern template void assign_sparse_to_sparse(SparseMatrix<double>&, const SparseMatrix<double>&);

}  // namespace Eigen::internal
